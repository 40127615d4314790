//! The `q3rays` program; see `q3rays --help`.

fn main() -> std::process::ExitCode {
    q3rays::cli::run()
}
