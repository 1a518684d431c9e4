/* A host for the board in simulated time: requests as frames, and the commands among them. */
#ifndef CLIENT_H
#define CLIENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../../registers.h"

/* Of a gain bank, in the order of their addresses: of all axes those that map 3 had, then those of
 * map 4. */
#define BANK_WORDS (FD_AXES * sizeof(struct fd_gain_bank) / 2u)
#define FIRST_BANK_WORDS (FD_AXES * offsetof(struct fd_gain_bank, friction_top_speed) / 2u)
#define CLIENT_KEY 0x13579bdfu
#define TABLE_ADDRESS FD_REG_TRAJECTORY_KIND
#define TABLE_WORDS (FD_REG_TRAJECTORY_Z_ACCELERATION + 2u - FD_REG_TRAJECTORY_KIND)
#define TABLE_AXIS_STRIDE (FD_REG_TRAJECTORY_Z_COMPONENTS - FD_REG_TRAJECTORY_X_COMPONENTS)

/* Append the CRC to a frame; gives its length with it. */
size_t client_close_frame(uint8_t *frame, size_t length);

/* Frame of function 16, without CRC; gives its length. */
size_t client_write_frame(uint8_t *frame, uint16_t address, const uint16_t *words, unsigned count);

/* Number of the Modbus exception with which a write was refused; 0 if it was not. */
unsigned client_write(uint16_t address, const uint16_t *words, unsigned count);
unsigned client_write_u32(uint16_t address, uint32_t value);

/* Values of single registers; abort where there is no answer. */
uint16_t client_u16(uint16_t address);
uint32_t client_u32(uint16_t address);
float client_f32(uint16_t address);

void client_put_u32(uint16_t *words, uint32_t value);
void client_put_f32(uint16_t *words, float value);

/* Words of a command with a fresh token. */
#define COMMAND_WORDS 6u
void client_command_words(uint16_t words[COMMAND_WORDS], enum fd_opcode opcode, uint32_t argument,
                        uint32_t key);

/* Send a command; gives what became of it so far. */
enum fd_result client_command(enum fd_opcode opcode, uint32_t argument);

void client_bank_words(const struct fd_gain_bank gains[FD_AXES], uint16_t words[BANK_WORDS]);

/* The writes that stage a bank, without its CRC: STAGED_WRITES of them, the nth here. */
#define STAGED_WORDS 92u
#define STAGED_WRITES ((BANK_WORDS - FIRST_BANK_WORDS) / STAGED_WORDS + 1u)
struct client_piece {
    uint16_t address;
    unsigned first, count; /* of the bank's words */
};
struct client_piece client_staged_piece(unsigned n);

/* Write the shadow bank; gives its CRC, or 0 where a write was refused. */
uint32_t client_stage(const struct fd_gain_bank gains[FD_AXES]);

/* A trajectory table as words from TABLE_ADDRESS on, all zero but for its lengths and kind. */
void client_begin_table(uint16_t table[TABLE_WORDS], enum fd_trajectorykind kind,
                      uint32_t lead_in_samples, uint32_t capture_samples);

/* Set a number of an axis, by the address that it has on axis x. */
void client_set_f32(uint16_t table[TABLE_WORDS], unsigned axis, uint16_t x_address, unsigned n,
                  float value);
void client_set_u16(uint16_t table[TABLE_WORDS], unsigned axis, uint16_t x_address, uint16_t value);

/* Write the registers that there are; false where one is refused. */
bool client_write_table(const uint16_t table[TABLE_WORDS]);

uint32_t client_table_crc(const uint16_t table[TABLE_WORDS]);

#endif
