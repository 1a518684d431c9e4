#include "snapshot.h"

#include <string.h>

/* By the GNU linker: where the initialized variables begin, and where all others end. */
extern char __data_start[], _end[];

size_t snapshot_size(void)
{
    return (size_t)(_end - __data_start);
}

void snapshot_take(void *kept)
{
    memcpy(kept, __data_start, snapshot_size());
}

void snapshot_restore(const void *kept)
{
    memcpy(__data_start, kept, snapshot_size());
}
