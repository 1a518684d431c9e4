/* The registers as words, with access and ranges as the map says.
 *
 * The sample interrupt reads and writes them too: in the main loop, hold the lock.
 */
#ifndef REGISTER_FILE_H
#define REGISTER_FILE_H

#include <stdint.h>

#include "../registers.h"

enum access {
    ACCESS_DONE,
    ACCESS_NO_REGISTER, /* there is none, or it is read-only */
    ACCESS_BAD_VALUE, /* outside its range */
};

/* ---- the firmware's side, by address of the first word */

uint16_t register_u16(uint16_t address);
uint32_t register_u32(uint16_t address);
float register_f32(uint16_t address);
void register_put_u16(uint16_t address, uint16_t value);
void register_put_u32(uint16_t address, uint32_t value);
void register_put_f32(uint16_t address, float value);

/* Gain banks of all axes; `stride` words lie between them. */
void register_take_gains(uint16_t address, uint16_t stride, struct fd_gain_bank gains[FD_AXES]);
void register_put_gains(uint16_t address, uint16_t stride,
                        const struct fd_gain_bank gains[FD_AXES]);

/* The words themselves, for checksums. */
const uint16_t *register_words(uint16_t address);

/* ---- the host's side */

enum access register_file_read(uint16_t address, uint16_t count, uint16_t *words);

/* All words or none. */
enum access register_file_write(uint16_t address, uint16_t count, const uint16_t *words);

#endif
