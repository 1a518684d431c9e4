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
    ACCESS_NO_REGISTER, /* there is none, it is read-only, or a value is cut in two */
    ACCESS_BAD_VALUE, /* outside its range */
    ACCESS_BUSY, /* not at present, or not by this host */
};

/* All zero, as after power-up. */
void register_file_init(void);

/* ---- the firmware's side, by address of the first word */

uint16_t register_u16(uint16_t address);
uint32_t register_u32(uint16_t address);
float register_f32(uint16_t address);
void register_put_u16(uint16_t address, uint16_t value);
void register_put_u32(uint16_t address, uint32_t value);
void register_put_f32(uint16_t address, float value);

/* The gain banks of the map. */
enum gain_group {
    GAINS_ACTIVE,
    GAINS_SHADOW,
    GAINS_MAXIMUM,
};

/* Gain banks of all axes. */
void register_take_gains(enum gain_group group, struct fd_gain_bank gains[FD_AXES]);
void register_put_gains(enum gain_group group, const struct fd_gain_bank gains[FD_AXES]);

/* CRC-32 of the words of a bank in the order of their addresses; not of the maxima. */
uint32_t register_gains_crc(enum gain_group group);

/* The words themselves, for checksums. */
const uint16_t *register_words(uint16_t address);

/* ---- the host's side; host_requests.h is what serves it */

enum access register_file_read(uint16_t address, uint16_t count, uint16_t *words);

/* Whether the map lets the host write these words. */
enum access register_file_check(uint16_t address, uint16_t count, const uint16_t *words);

/* Write words that were checked. */
void register_file_write(uint16_t address, uint16_t count, const uint16_t *words);

#endif
