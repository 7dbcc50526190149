//! Prints what the maker of a chip says of it, as JSON: `cargo run --package agv-chip-description --features stm32h743zi`.

#[cfg(any(feature = "stm32h723zg", feature = "stm32h743zi"))]
mod metadata;

#[cfg(any(feature = "stm32h723zg", feature = "stm32h743zi"))]
fn main() -> anyhow::Result<()> {
    println!("{}", serde_json::to_string(&metadata::describe()?)?);
    Ok(())
}

#[cfg(not(any(feature = "stm32h723zg", feature = "stm32h743zi")))]
fn main() -> anyhow::Result<()> {
    anyhow::bail!("name a chip: --features stm32h743zi")
}
