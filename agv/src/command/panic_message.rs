//! What is said when the program itself is at fault, or when nobody takes what it prints.

use std::process::exit;

use agv_host_sim::foreign_code;

/// How the standard library begins the panic of `println!`.
const PRINTING: &str = "failed printing to stdout: ";

/// From now on a panic is one line. A reader that closes the pipe, as `head` does, ends the program without a word; a
/// result that cannot be written otherwise is a failure.
pub fn install() {
    std::panic::set_hook(Box::new(|panic| {
        if foreign_code::is_at_work() {
            return;
        }
        let message = panic.payload_as_str().unwrap_or_default();
        if let Some(reason) = message.strip_prefix(PRINTING) {
            if reason.starts_with("Broken pipe") {
                exit(0);
            }
            eprintln!("agv: the result cannot be written: {reason}");
            exit(1);
        }
        let place = panic.location().map(ToString::to_string).unwrap_or_default();
        let message: String = message.split_whitespace().collect::<Vec<_>>().join(" ");
        eprintln!("agv: this is a fault of the program, at {place}: {message}");
    }));
}
