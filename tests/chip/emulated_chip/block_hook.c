/* Counts what the processor has run and stops it where something is due: at each block of code, so not in Python. */
#include <stdint.h>

struct progress {
    uint64_t halfwords;
    uint64_t limit;
    uint64_t block;
    uint32_t is_pending;
    int32_t masks[3];
    int (*stop)(void *engine);
    int (*read)(void *engine, int register_number, void *value);
};

static int is_masked(void *engine, const struct progress *progress) {
    for (int number = 0; number < 3; number++) {
        uint32_t mask = 0;
        progress->read(engine, progress->masks[number], &mask);
        if (mask) {
            return 1;
        }
    }
    return 0;
}

void count_block(void *engine, uint64_t address, uint32_t size, struct progress *progress) {
    progress->block = address;
    if (progress->halfwords >= progress->limit || (progress->is_pending && !is_masked(engine, progress))) {
        progress->stop(engine);
        return;
    }
    progress->halfwords += size / 2;
}
