"""Discrete lines on the pins that the board has for them."""

from bench import check_sound, emergencies
from checks.can import ask
from checks.retained import restarted_after
from emulated_chip.clock import MILLISECOND
from injected_panic import panic

# What is on the Arduino connector, and the LEDs (UM2407).
POSE_VALID, WITHIN_DOCKING_LIMITS, FAULT = "PD15", "PD14", "PA6"
GREEN, RED = "PB0", "PB14"
STANDSTILL, RESET = "PG9", "PG14"
INPUT, PULLED_DOWN = 0, 2


def port(chip, pin):
    return chip.peripherals[f"GPIO{pin[1]}"], int(pin[2:])


def level(chip, pin):
    gpio, number = port(chip, pin)
    return gpio.level(number)


def drive(chip, pin, is_high):
    gpio, number = port(chip, pin)
    gpio.drive(number, is_high)


def says_no_more_than_it_knows(bench):
    """Without a pose none is valid; the fault line, and its LED, are as the bus is told."""
    chip = bench.started()
    chip.run_for(100 * MILLISECOND)
    check_sound(chip)
    levels = [level(chip, pin) for pin in (POSE_VALID, GREEN, WITHIN_DOCKING_LIMITS)]
    assert levels == [False, False, False], f"a pose is valid: {levels}"
    is_sound = not emergencies(chip)
    assert (level(chip, FAULT), level(chip, RED)) == (is_sound, not is_sound), emergencies(chip)
    for pin in (STANDSTILL, RESET):
        gpio, number = port(chip, pin)
        wanted = (INPUT, PULLED_DOWN)
        found = (gpio.get("MODER", f"MODER[{number}]"), gpio.get("PUPDR", f"PUPDR[{number}]"))
        assert found == wanted, f"{pin} is {found}"


def tells_a_panic_on_its_wire(bench):
    """A panic is a fault until the next start; an edge at the reset forgets that it was, and not that it is."""
    chip = restarted_after(bench, panic)
    assert (level(chip, FAULT), level(chip, RED)) == (False, True), emergencies(chip)
    remembered = lambda: ask(chip, 0x40, 0x03, 0x10, 0, 0, 0, 0, 0)[4]
    assert remembered() >= 1, "nothing is remembered"
    drive(chip, RESET, True)
    chip.run_for(10 * MILLISECOND)
    assert remembered() >= 1, "a contact may bounce"
    chip.run_for(30 * MILLISECOND)
    assert remembered() == 0, "nothing was reset"
    assert level(chip, FAULT) is False, "the fault is there all the same"


CHECKS = [says_no_more_than_it_knows, tells_a_panic_on_its_wire]
