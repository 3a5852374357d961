//! The program; see `gnss_twin::cli`.

fn main() -> std::process::ExitCode {
    gnss_twin::cli::main()
}
