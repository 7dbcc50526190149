//! What the maker of the chip says of it, for the emulated one: memories, interrupts, registers with their fields, and the
//! bit of the clock control without which a peripheral does not answer.
//!
//! It comes from `stm32-metapac`, which is made of the maker's own descriptions, and is written as JSON for a program in
//! another language.

use anyhow::{Context, anyhow};
use serde_json::{Map, Value, json};
use stm32_metapac::metadata::ir::{Array, BitOffset, BlockItemInner, IR};
use stm32_metapac::metadata::{METADATA, PeripheralRccRegister};

/// The description of the chip.
///
/// # Errors
/// If a peripheral names a clock bit that the clock control does not have.
pub fn describe() -> anyhow::Result<Value> {
    let registers = |name: &str| METADATA.peripherals.iter().find(|one| one.name == name)?.registers.as_ref();
    let rcc = registers("RCC").context("the chip has no clock control")?.ir;
    let mut peripherals = Vec::new();
    let mut kinds = Map::new();
    for one in METADATA.peripherals {
        let bit = |register: Option<&PeripheralRccRegister>| register.map(|register| place(rcc, register)).transpose();
        let clock = one.rcc.as_ref();
        peripherals.push(json!({
            "name": one.name,
            "address": one.address,
            "kind": one.registers.as_ref().map(|registers| registers.kind),
            "enable": bit(clock.and_then(|clock| clock.enable.as_ref()))?,
            "reset": bit(clock.and_then(|clock| clock.reset.as_ref()))?,
        }));
        if let Some(registers) = &one.registers {
            kinds.entry(registers.kind).or_insert_with(|| fields(registers.ir));
        }
    }
    let interrupts: Map<_, _> =
        METADATA.interrupts.iter().map(|one| (one.name.to_owned(), one.number.into())).collect();
    let memory: Vec<Value> = METADATA
        .memory
        .iter()
        .copied()
        .flatten()
        .map(|region| json!({ "name": region.name, "address": region.address, "size": region.size }))
        .collect();
    Ok(
        json!({ "name": METADATA.name, "memory": memory, "interrupts": interrupts, "peripherals": peripherals, "kinds": kinds }),
    )
}

/// Offset and bit of a field of the clock control.
fn place(rcc: &IR, wanted: &PeripheralRccRegister) -> anyhow::Result<Value> {
    let all = fields(rcc);
    let register = &all[wanted.register];
    let bit = &register["fields"][wanted.field]["bit"];
    let found = bit.as_u64().ok_or_else(|| anyhow!("there is no {} in {}", wanted.field, wanted.register))?;
    Ok(json!({ "register": wanted.register, "field": wanted.field, "offset": register["offset"], "bit": found }))
}

/// Registers by their names, those of blocks in blocks with the block's name before a dot.
fn fields(ir: &IR) -> Value {
    let mut found = Map::new();
    if let Some(block) = ir.blocks.first() {
        // The block that holds the others is the one that no other holds.
        let is_held = |name: &str| {
            ir.blocks
                .iter()
                .flat_map(|block| block.items)
                .any(|item| matches!(&item.inner, BlockItemInner::Block(inner) if inner.block == name))
        };
        let top = ir.blocks.iter().find(|block| !is_held(block.name)).unwrap_or(block);
        collect(ir, top.name, "", 0, &mut found);
    }
    Value::Object(found)
}

fn collect(ir: &IR, block: &str, prefix: &str, base: u32, found: &mut Map<String, Value>) {
    let Some(block) = ir.blocks.iter().find(|one| one.name == block) else { return };
    for item in block.items {
        for (number, step) in offsets(item.array.as_ref()).into_iter().enumerate() {
            let number = if item.array.is_some() { format!("[{number}]") } else { String::new() };
            let name = format!("{prefix}{}{number}", item.name.to_uppercase());
            let offset = base + item.byte_offset + step;
            match &item.inner {
                BlockItemInner::Block(inner) => collect(ir, inner.block, &format!("{name}."), offset, found),
                BlockItemInner::Register(register) => {
                    let set = ir.fieldsets.iter().find(|set| Some(set.name) == register.fieldset);
                    found.insert(
                        name,
                        json!({ "offset": offset, "fields": set.map_or(json!({}), |set| bits(set.fields)) }),
                    );
                }
            }
        }
    }
}

fn bits(fields: &[stm32_metapac::metadata::ir::Field]) -> Value {
    let mut found = Map::new();
    for field in fields {
        let BitOffset::Regular(first) = &field.bit_offset else { continue };
        for (number, step) in offsets(field.array.as_ref()).into_iter().enumerate() {
            let number = if field.array.is_some() { format!("[{number}]") } else { String::new() };
            let place = json!({ "bit": first.offset + step, "size": field.bit_size });
            found.insert(format!("{}{number}", field.name.to_uppercase()), place);
        }
    }
    Value::Object(found)
}

fn offsets(array: Option<&Array>) -> Vec<u32> {
    match array {
        None => vec![0],
        Some(Array::Regular(regular)) => (0..regular.len).map(|number| number * regular.stride).collect(),
        Some(Array::Cursed(cursed)) => cursed.offsets.to_vec(),
    }
}
