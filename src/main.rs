//! The `etendue` command: parses its arguments, calls the library, and returns an exit code.

mod cli;

use std::process::ExitCode;

use clap::Parser as _;

#[global_allocator]
static ALLOCATOR: cli::allocator::OrExit = cli::allocator::OrExit;

fn main() -> ExitCode {
    match cli::Cli::parse().run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::from(cli::BAD_INPUT)
        }
    }
}
