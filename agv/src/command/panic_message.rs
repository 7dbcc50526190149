//! What is said when the program itself is at fault.

/// From now on a panic is one line. A reader that closes the pipe, as `head` does, ends the program without a word.
pub fn install() {
    std::panic::set_hook(Box::new(|panic| {
        let message = panic.payload_as_str().unwrap_or_default();
        if message.starts_with("failed printing to stdout") {
            std::process::exit(0);
        }
        let place = panic.location().map(ToString::to_string).unwrap_or_default();
        let message: String = message.split_whitespace().collect::<Vec<_>>().join(" ");
        eprintln!("agv: this is a fault of the program, at {place}: {message}");
    }));
}
