//! The models of the coupling modes and of execution time. Numbers in, numbers out.
