"""From reset to the loop."""

from bench import check_sound, describe, note_depths, poses, stack_of
from emulated_chip.clock import MILLISECOND
from emulated_chip.exceptions import BUS_FAULT, HARD_FAULT
from emulated_chip.system_control import BFAR, CCR, DATA_CACHE_ON, INSTRUCTION_CACHE_ON
from injected_panic import add_atomically
from unicorn import arm_const as arm

# The whole start with an empty flash: memory at 64 MHz, oscillators, PHY.
LONGEST_START = 200 * MILLISECOND
# AXI_TARG7_FN_MOD in the network of buses (2.2.4).
TARGET_7 = 0x8108
# External memory, of which the boards have none (2.3, table 8).
FIRST_OUTSIDE, LAST_OUTSIDE = 0x6000_0000, 0xDFFF_FFFC
# What of a region makes it shareable: S of MPU_RASR (ARMv7-M ARM, B3.5.9).
SHAREABLE = 1 << 18

# Share of the stack that the start may take.
MOST_OF_STACK = 0.9


def boot(bench, **options):
    return to_the_loop(bench.chip(**options))


def to_the_loop(chip):
    chip.run_for(LONGEST_START, stop=lambda: chip.sleeps > 0)
    return chip


def boots(bench):
    """The image comes to its loop, which sleeps, without a fault and without touching what has no clock."""
    chip = bench.chip()
    depths = note_depths(chip)
    to_the_loop(chip)
    assert chip.sleeps > 0, describe(chip)
    check_sound(chip)
    # Painted when the program begins, and when its large values are built.
    assert len(depths) == 2 and 1000 < depths[1] <= MOST_OF_STACK * stack_of(chip)[1], depths
    bench.note("stack_at_start", depths[1])
    bench.note("start_ms", chip.clock.now() / MILLISECOND)
    chip.run_for(100 * MILLISECOND)
    bench.note("first_pose_ms", poses(chip)[0] / MILLISECOND)


def has_the_clocks_of_the_manual(bench):
    """Registers after the start, each against what the manual asks for."""
    chip = boot(bench)
    chip.run_for(100 * MILLISECOND)
    assert not chip.findings, describe(chip)
    rcc, fdcan, flash = (chip.peripherals[name] for name in ("RCC", "FDCAN1", "FLASH"))
    timing = {name: fdcan.get("NBTP", name) + 1 for name in ("NBRP", "NTSEG1", "NTSEG2", "NSJW")}
    quanta = 1 + timing["NTSEG1"] + timing["NTSEG2"]
    gpio = lambda pin: chip.peripherals[f"GPIO{pin[1]}"].alternate_function(int(pin[2:]))
    interrupts = chip.description.interrupts
    latency, delay = (4, 2) if chip.description.variant.has_overdrive else (3, 3)
    priority = lambda name: chip.system.priority(interrupts[name] + 16)
    expected = [
        # DS12110, "General operating conditions": 480 MHz, with the buses at half and a quarter of it, at scale 0; DS13313
        # allows 520 MHz with error correction in all memories, 260 and 130.
        ("processor clock", rcc.processor_clock(), 480_000_000),
        ("bus clock", rcc.bus_clock(), 240_000_000),
        ("peripheral clock", rcc.peripheral_clock("D2CFGR", "D2PPRE1"), 120_000_000),
        ("voltage scale", chip.peripherals["PWR"].scale(), 0),
        # RM0433, table 17 in 4.3.8: scale 0, from 225 to 240 MHz; RM0468, table 16 in 4.3.8: scale 0, from 210 to 275 MHz.
        ("flash wait states", flash.get("ACR", "LATENCY"), latency),
        ("flash signal delay", flash.get("ACR", "WRHIGHFREQ"), delay),
        # CiA 301, table 1: 500 kbit/s, sample point 87.5 %.
        ("bit rate", fdcan.bit_rate(), 500_000),
        ("sample point", (1 + timing["NTSEG1"]) / quanta, 0.875),
        # As wide as the second segment allows, for the widest tolerance of oscillators (ISO 11898-1, 11.3.1.1).
        ("synchronisation jump", timing["NSJW"], timing["NTSEG2"]),
        # UM2407, table of the Ethernet pins; DS12110, table of alternate functions.
        *((f"Ethernet on {pin}", gpio(pin), 11) for pin in "PA1 PA2 PA7 PC1 PC4 PC5 PB13 PG11 PG13".split()),
        *((f"CAN on {pin}", gpio(pin), 9) for pin in ("PD0", "PD1")),
        ("data cache", bool(chip.system.words[CCR] & DATA_CACHE_ON), True),
        ("instruction cache", bool(chip.system.words[CCR] & INSTRUCTION_CACHE_ON), True),
        # Chapter 60: a debugger that holds the processor is no reason to restart it.
        ("watchdog stands at breakpoints", chip.peripherals["DBGMCU"].get("APB4FZR1", "IWDG1"), 1),
        # 8.5.3: who watches the debugger's clock.
        ("clock security system", rcc.get("CR", "HSECSSON"), 1),
        # The DMA of the Ethernet goes past the cache (58.10); settings are read as they are.
        ("RAM of the Ethernet is cached", chip.system.is_cached(0x3000_0000), False),
        ("settings are cached", chip.system.is_cached(chip.description.variant.settings), False),
        # Nobody watches exclusive accesses on the bus (DDI0489, 5.6.2): no RAM that may be written is shareable.
        *((f"{name} is shareable", is_shared(chip, ram), False) for name, ram in chip.rams.items()),
        # Arm's erratum 1013783: the default map alone does not keep preloads from where there is no memory.
        *((f"{place:#x} can be read", not chip.system.forbids(place, False), False) for place in (FIRST_OUTSIDE, LAST_OUTSIDE)),
    ]
    wrong = [f"{name} is {found}, not {wanted}" for name, found, wanted in expected if found != wanted]
    order = ["FDCAN1_IT0", "TIM2", "UART7", "ETH", "UART8"]
    priorities = [priority(name) for name in order]
    if priorities != sorted(set(priorities)):
        wrong.append(f"priorities of {order} are {priorities}")
    assert not wrong, "; ".join(wrong)
    bench.note("registers", len(expected))


def is_shared(chip, ram):
    """Whether the beginning or the end of a RAM is shareable, and may be written."""
    ends = (ram.base, ram.base + ram.size - 4)
    return any(chip.system.is_shared(place) and not chip.system.forbids(place, True) for place in ends)


def runs_on_older_silicon(bench):
    """Revision Y allows 400 MHz at scale 1, and wants a workaround on the bus of its RAM; newer ones want none."""
    chip = boot(bench, revision="Y")
    chip.run_for(100 * MILLISECOND)
    check_sound(chip)
    rcc, fdcan, flash = (chip.peripherals[name] for name in ("RCC", "FDCAN1", "FLASH"))
    expected = [
        # DS12110, "General operating conditions", revision Y.
        ("processor clock", rcc.processor_clock(), 400_000_000),
        ("bus clock", rcc.bus_clock(), 200_000_000),
        ("peripheral clock", rcc.peripheral_clock("D2CFGR", "D2PPRE1"), 100_000_000),
        ("voltage scale", chip.peripherals["PWR"].scale(), 1),
        # Table 17 in 4.3.8: scale 1, from 185 to 210 MHz.
        ("flash wait states", flash.get("ACR", "LATENCY"), 2),
        ("bit rate", fdcan.bit_rate(), 500_000),
        # ES0392, 2.2.9: READ_ISS_OVERRIDE of target 7.
        ("workaround", chip.peripherals["AXI"].words.get(TARGET_7, 0), 1),
    ]
    wrong = [f"{name} is {found}, not {wanted}" for name, found, wanted in expected if found != wanted]
    assert not wrong, "; ".join(wrong)
    assert poses(chip), "no pose on the bus"
    newer = boot(bench)
    assert TARGET_7 not in newer.peripherals["AXI"].words, "the workaround is for older silicon"


def takes_exclusive_accesses_where_they_work(bench):
    """An atomic operation in the memory that outlives a restart is made; the chip answers one with a bus fault once that memory
    is shareable, as the processor does."""
    chip = boot(bench)
    kept = chip.rams["SRAM4"].base
    stop = lambda: chip.processor.get(arm.UC_ARM_REG_R2) == 0 or chip.exceptions.taken
    add_atomically(chip, kept)
    chip.run_for(MILLISECOND, stop)
    assert not chip.exceptions.taken and chip.processor.get(arm.UC_ARM_REG_R2) == 0, describe(chip)
    for region in chip.system.regions.values():
        region.attributes |= SHAREABLE
    add_atomically(chip, kept)
    chip.run_for(MILLISECOND, stop)
    assert [number for _, number, _ in chip.exceptions.taken[:1]] in ([BUS_FAULT], [HARD_FAULT]), "it was made"
    assert chip.system.words.get(BFAR) == kept, describe(chip)


def asks_for_random_numbers(bench):
    """What the network begins with comes from the generator; without one the vehicle goes on."""
    chip = boot(bench)
    assert chip.peripherals["RNG"].given >= 2, "nobody has asked"
    mute = bench.chip()
    mute.peripherals["RNG"]._status = lambda: 0
    mute.peripherals["RNG"].on_read("SR", lambda: 0)
    mute.run_for(LONGEST_START, stop=lambda: mute.sleeps > 0)
    assert mute.sleeps > 0, describe(mute)
    check_sound(mute)


def every_clock_is_needed(bench):
    """Each clock bit that the image sets is missed when the chip ignores it: nothing is switched on for nothing, and
    nothing would go unnoticed if it were left out."""
    chip = boot(bench)
    chip.run_for(200 * MILLISECOND)
    assert not chip.findings, describe(chip)
    bits = chip.peripherals["RCC"].enabled()
    unnoticed = []
    for bit in bits:
        mutant = bench.chip()
        mutant.peripherals["RCC"].ignored = {bit}
        mutant.run_for(400 * MILLISECOND)
        if is_well(mutant):
            unnoticed.append(".".join(bit))
    bench.note("clock_bits", len(bits))
    assert bits and not unnoticed, f"nobody misses {', '.join(unnoticed)}"


def is_well(chip):
    """The loop was reached, the bus is alive, and the Ethernet's DMA has started."""
    has_network = chip.peripherals["ETH"].get("ETHERNET_DMA.DMACRX_CR", "SR")
    return chip.sleeps > 0 and not chip.findings and not chip.exceptions.taken and chip.listener.heard and has_network


runs_on_older_silicon.chips = ["STM32H743ZI"]

CHECKS = [
    boots,
    has_the_clocks_of_the_manual,
    runs_on_older_silicon,
    takes_exclusive_accesses_where_they_work,
    asks_for_random_numbers,
    every_clock_is_needed,
]
