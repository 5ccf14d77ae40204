//! The `relievo` command.

fn main() -> std::process::ExitCode {
    relievo::cli::main()
}
