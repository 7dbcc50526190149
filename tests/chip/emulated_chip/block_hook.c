/* Counts what the processor has run and stops it where something is due: at each block of code, so not in Python. */
#include <stdint.h>

struct progress {
    uint64_t halfwords;
    uint64_t limit;
    uint64_t block;
    uint32_t is_pending;
    int32_t primask;
    int (*stop)(void *engine);
    int (*read)(void *engine, int register_number, void *value);
};

void count_block(void *engine, uint64_t address, uint32_t size, struct progress *progress) {
    progress->block = address;
    if (progress->halfwords >= progress->limit) {
        progress->stop(engine);
        return;
    }
    progress->halfwords += size / 2;
    if (progress->is_pending) {
        uint32_t primask = 1;
        progress->read(engine, progress->primask, &primask);
        if (!(primask & 1)) {
            progress->stop(engine);
        }
    }
}
