"""Who listens to the log, and who only seems to."""

from bench import check_sound
from emulated_chip.clock import MILLISECOND, SECOND
from emulated_chip.network import Host

# Addresses of the host and of the controller as it is set at first, and the port of its log.
HOST, CONTROLLER, PORT = (192, 168, 1, 99), (192, 168, 1, 20), 5350


def host_of(chip):
    """A host that knows where the controller is, whose link is up."""
    host = Host(chip, HOST, CONTROLLER)
    while host.connect(PORT + 1) is None:
        chip.run_for(20 * MILLISECOND)
    return host


def listen(chip, host):
    """A connection on which the log is told."""
    log = host.connect(PORT)
    chip.run_for(SECOND)
    assert log.is_open and log.received, "no log is told"
    return log


def outlives_a_half_open_connection(bench):
    """Somebody asks for the log and goes away before the connection is there: the next one is told it all the same."""
    chip = bench.started()
    chip.run_for(3 * SECOND)
    host = host_of(chip)
    gone = host.connect(PORT)
    gone.is_over = True
    gone.hear = lambda *_: None
    chip.run_for(8 * SECOND)
    assert not gone.is_open
    listen(chip, host)
    check_sound(chip)


def tells_its_log_as_long_as_somebody_listens(bench):
    """Nothing ends a connection on which only one side speaks."""
    chip = bench.started()
    chip.run_for(3 * SECOND)
    log = listen(chip, host_of(chip))
    for _ in range(60 if bench.is_long else 12):
        told = len(log.received)
        chip.run_for(SECOND)
        assert not log.is_over and len(log.received) > told, "the log has ended"
    check_sound(chip)


CHECKS = [outlives_a_half_open_connection, tells_its_log_as_long_as_somebody_listens]
