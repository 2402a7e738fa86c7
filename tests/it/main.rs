//! One binary, a module per promise.
