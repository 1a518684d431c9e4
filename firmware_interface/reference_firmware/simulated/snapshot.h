/* All variables of the program, put aside and brought back: what has happened since has not. */
#ifndef SNAPSHOT_H
#define SNAPSHOT_H

#include <stddef.h>

size_t snapshot_size(void);

/* `kept` has room for so many bytes and is none of the variables. */
void snapshot_take(void *kept);
void snapshot_restore(const void *kept);

#endif
