"""The bus when it is not as it should be."""

from collections import Counter

from bench import check_sound, emergencies, longest_gap, poses, start
from emulated_chip.can_bus import CanFrame
from emulated_chip.clock import MILLISECOND, SECOND
from stored_settings import BIT_RATE_250, FIRST_PAGE, write

# Oldest pose that may be sent when the bus is back.
OLDEST = 30 * MILLISECOND
BACK_FROM_OFF = 0x8140
HEARTBEAT_LOST = 0x8130
COUNTS = 16
# What is said of each pose: its position, heading, covariance, status and integrity (TPDO 1 to 5).
SETS = (0x190, 0x290, 0x390, 0x490, 0x690)
PERIOD = 10 * MILLISECOND


def counts(chip, since=0, identifier=0x190):
    """The counter of each pose, of four bits, with the time at which it was heard."""
    return [(time, frame.data[7] >> 4) for time, frame in chip.listener.of(identifier, since)]


def age(first, later):
    """By how much a pose is older than it should be, ns, from another one: up to half of what the counter counts."""
    periods = round((later[0] - first[0]) / PERIOD) - (later[1] - first[1])
    return (periods % COUNTS if periods % COUNTS <= COUNTS // 2 else 0) * PERIOD


def sends_nothing_stale(bench):
    """Unplugged for five seconds and plugged in again: what is sent is of now."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    first = counts(chip)[-1]
    fdcan = chip.peripherals["FDCAN1"]
    fdcan.is_plugged = False
    chip.run_for(5 * SECOND)
    fdcan.is_plugged = True
    chip.can_bus.changed()
    begin = chip.clock.now()
    chip.run_for(500 * MILLISECOND)
    check_sound(chip)
    sent = counts(chip, begin)
    assert sent, "the bus stays silent"
    oldest = max(age(first, later) for later in sent)
    bench.note("oldest_pose_ms", oldest // MILLISECOND)
    assert oldest <= OLDEST, f"a pose of {oldest // MILLISECOND} ms ago is sent"
    burst = [time for time, _ in chip.listener.heard if begin <= time < begin + PERIOD]
    bench.note("frames_in_the_first_10_ms", len(burst))
    # One that has tried, those of one pose, a heartbeat.
    assert len(burst) <= 6, f"{len(burst)} frames come at once"
    gap = longest_gap(poses(chip, begin), begin, chip.clock.now())
    assert gap <= 40 * MILLISECOND, f"no pose for {gap / 1e6:.1f} ms"


# Transmit errors of 31 frames, each of which costs eight; error passive ends below 128 (ISO 11898-1).
MANY_ERRORS, PASSIVE = 247, 128


def says_all_of_it_while_error_passive(bench):
    """The bus was disturbed and is sound again: as long as the controller is error passive, everything is said as often as before."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    said = lambda since: Counter(frame.identifier for time, frame in chip.listener.heard if time >= since)
    before = chip.clock.now()
    chip.run_for(200 * MILLISECOND)
    usual = said(before)
    fdcan = chip.peripherals["FDCAN1"]
    fdcan._errors = MANY_ERRORS
    begin = chip.clock.now()
    chip.run_for(200 * MILLISECOND)
    check_sound(chip)
    assert fdcan._errors >= PASSIVE, "error passive is over too soon to tell"
    found = said(begin)
    bench.note("frames_in_200_ms", {f"{identifier:x}h": count for identifier, count in sorted(found.items())})
    rare = {f"{identifier:x}h": (found[identifier], count) for identifier, count in usual.items() if found[identifier] + 1 < count}
    assert not rare, f"frames while error passive, and before: {rare}"


# Time of a burst of others' frames, which all go first, and from the start of one to the next.
BURST, BURSTS = 15 * MILLISECOND, 41 * MILLISECOND


def keeps_the_order_of_its_frames(bench):
    """Others keep the bus busy again and again: of each identifier the frames come in the order of their counts, and of all that
    belong to one pose all come or none."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    begin = chip.clock.now()
    frame = CanFrame(0x001, b"12345678")
    count = BURST * chip.can_bus.bit_rate // SECOND // frame.bits()
    for _ in range(50 if bench.is_long else 15):
        for _ in range(count):
            chip.can_bus.send(chip.listener, frame)
        chip.run_for(BURSTS)
    chip.run_for(50 * MILLISECOND)
    check_sound(chip)
    sets = {}
    for identifier in SETS:
        found = [number for _, number in counts(chip, begin, identifier)]
        wrong = [(earlier, later) for earlier, later in zip(found, found[1:]) if (later - earlier) % COUNTS > COUNTS // 2]
        assert not wrong, f"counts of {identifier:x}h that follow each other on the bus: {wrong[:5]}"
        sets[identifier] = len(found)
    bench.note("poses", sets[SETS[0]])
    assert max(sets.values()) - min(sets.values()) <= 1, f"frames of each kind: {sets}"


def comes_back_from_bus_off(bench):
    """A short circuit for two seconds: the controller goes off, waits longer each time, comes back and says so."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    fdcan = chip.peripherals["FDCAN1"]
    offs = []
    go_off = fdcan._go_off
    fdcan._go_off = lambda: (offs.append(chip.clock.now()), go_off())
    chip.can_bus.is_shorted = True
    chip.can_bus.changed()
    chip.run_for(2 * SECOND)
    chip.can_bus.is_shorted = False
    chip.can_bus.changed()
    begin = chip.clock.now()
    chip.run_for(4 * SECOND)
    check_sound(chip)
    assert poses(chip, begin), "the bus stays silent"
    assert BACK_FROM_OFF in emergencies(chip, begin), f"emergencies: {emergencies(chip, begin)}"
    waits = [later - earlier for earlier, later in zip(offs, offs[1:])]
    bench.note("offs", len(offs))
    assert 1 <= len(offs) <= 6 and waits == sorted(waits), f"it has gone off {len(offs)} times in two seconds"


def hears_only_what_is_meant_for_it(bench):
    """A bus that others fill: their frames do not come to the processor."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    fdcan = chip.peripherals["FDCAN1"]
    refused = fdcan.refused
    others = [0x100 + number for number in (5, 0x33, 0x45)] * 100
    for identifier in others:
        chip.can_bus.send(chip.listener, CanFrame(identifier, b"12345678"))
    chip.run_for(400 * MILLISECOND)
    check_sound(chip)
    bench.note("refused", fdcan.refused - refused)
    assert fdcan.refused - refused == len(others), f"{len(others) - fdcan.refused + refused} frames came through"
    # A request for the controller itself does: its device type, object 1000h (CiA 301, 7.5.2.1).
    chip.can_bus.send(chip.listener, CanFrame(0x610, bytes([0x40, 0x00, 0x10, 0, 0, 0, 0, 0])))
    begin = chip.clock.now()
    chip.run_for(50 * MILLISECOND)
    assert chip.listener.of(0x590, begin), "no answer to a request"


def tells_of_an_overrun(bench):
    """More than the controller's queue holds comes while the processor takes nothing: the bus is told that frames were lost."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    interrupts = [chip.description.interrupts["FDCAN1_IT0"] + 16]
    chip.exceptions.blocked = set(interrupts)
    for _ in range(8):
        chip.can_bus.send(chip.listener, CanFrame(0x080))
    begin = chip.clock.now()
    chip.run_for(5 * MILLISECOND)
    assert chip.peripherals["FDCAN1"].lost > 0, "nothing was lost"
    chip.exceptions.blocked = set()
    chip.exceptions.take()
    chip.run_for(200 * MILLISECOND)
    check_sound(chip)
    assert 0x8110 in emergencies(chip, begin), f"emergencies: {emergencies(chip, begin)}"


def ask(chip, *data, patience=10 * MILLISECOND):
    """The answer to a request for an object (CiA 301, 7.2.4)."""
    # What was heard just now answers something else.
    begin = chip.clock.now() + 1
    chip.can_bus.send(chip.listener, CanFrame(0x610, bytes(data)))
    chip.run_for(patience, stop=lambda: chip.listener.of(0x590, begin))
    answers = chip.listener.of(0x590, begin)
    assert len(answers) == 1, f"{len(answers)} answers"
    return answers[0][1].data


def serves_its_objects(bench):
    """The name of the board comes in segments; what there is not is refused with its reason."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    first = ask(chip, 0x40, 0x09, 0x10, 0, 0, 0, 0, 0)
    length, name, toggle = int.from_bytes(first[4:], "little"), b"", 0
    assert first[0] == 0x41, f"the name begins with {first.hex()}"
    while len(name) < length:
        segment = ask(chip, 0x60 | toggle, 0, 0, 0, 0, 0, 0, 0)
        name += segment[1 : 8 - (segment[0] >> 1 & 7)]
        toggle ^= 0x10
    assert name.decode() == bench.description.variant.board, f"the name is {name}"
    # Mode, object 2013h:1: a vehicle without a map is not localised. Block transfers are refused (7.2.4.3.17).
    assert ask(chip, 0x40, 0x13, 0x20, 1, 0, 0, 0, 0)[:5] == bytes([0x4F, 0x13, 0x20, 1, 0])
    assert ask(chip, 0xA0, 0x09, 0x10, 0, 0, 0, 0, 0)[4:] == (0x0504_0001).to_bytes(4, "little")
    check_sound(chip)


def watches_a_heartbeat(bench):
    """A master has node 25h watched: its frames come through from then on, and its silence is told (7.2.8.3.2.2)."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    fdcan = chip.peripherals["FDCAN1"]
    heartbeat = CanFrame(0x725, bytes([5]))
    refused = fdcan.refused
    chip.can_bus.send(chip.listener, heartbeat)
    chip.run_for(10 * MILLISECOND)
    assert fdcan.refused == refused + 1, "a node that nobody has named is heard"
    assert ask(chip, 0x23, 0x16, 0x10, 1, 200, 0, 0x25, 0)[0] == 0x60, "the watch is refused"
    for _ in range(3):
        chip.can_bus.send(chip.listener, heartbeat)
        chip.run_for(100 * MILLISECOND)
    assert fdcan.refused == refused + 1, "the node that is watched is not heard"
    begin = chip.clock.now()
    assert HEARTBEAT_LOST not in emergencies(chip), "it was told too early"
    chip.run_for(150 * MILLISECOND)
    assert HEARTBEAT_LOST in emergencies(chip, begin), f"emergencies: {emergencies(chip, begin)}"
    check_sound(chip)


def runs_at_the_bit_rate_that_is_set(bench):
    """250 kbit/s in flash: the timing of a bit as CiA 301 (table 1) wants it, and poses on the bus."""
    chip = bench.chip()
    write(chip.settings_flash, FIRST_PAGE, BIT_RATE_250)
    chip.can_bus.bit_rate = 250_000
    start(chip)
    chip.run_for(200 * MILLISECOND)
    check_sound(chip)
    fdcan = chip.peripherals["FDCAN1"]
    before, behind = fdcan.get("NBTP", "NTSEG1") + 2, fdcan.get("NBTP", "NTSEG2") + 1
    assert fdcan.bit_rate() == 250_000, f"{fdcan.bit_rate()} bit/s"
    assert before / (before + behind) == 0.875, f"sample point {before / (before + behind)}"
    assert poses(chip), "no pose"


CHECKS = [
    sends_nothing_stale,
    says_all_of_it_while_error_passive,
    keeps_the_order_of_its_frames,
    comes_back_from_bus_off,
    hears_only_what_is_meant_for_it,
    tells_of_an_overrun,
    serves_its_objects,
    watches_a_heartbeat,
    runs_at_the_bit_rate_that_is_set,
]
