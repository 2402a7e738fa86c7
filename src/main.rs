//! The `overfly` program: parses the command line and runs one command.

fn main() -> std::process::ExitCode {
    overfly::cli::run()
}
