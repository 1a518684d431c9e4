#include "client.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../crc.h"
#include "simulation.h"

size_t client_close_frame(uint8_t *frame, size_t length)
{
    const uint16_t crc = crc16(frame, length);
    frame[length] = (uint8_t)crc;
    frame[length + 1u] = (uint8_t)(crc >> 8);
    return length + 2u;
}

static void put_word(uint8_t *bytes, uint16_t word)
{
    bytes[0] = (uint8_t)(word >> 8);
    bytes[1] = (uint8_t)word;
}

size_t client_write_frame(uint8_t *frame, uint16_t address, const uint16_t *words, unsigned count)
{
    frame[0] = 1u;
    frame[1] = 16u;
    put_word(&frame[2], address);
    put_word(&frame[4], (uint16_t)count);
    frame[6] = (uint8_t)(2u * count);
    for (unsigned n = 0; n < count; n++) {
        put_word(&frame[7u + 2u * n], words[n]);
    }
    return 7u + 2u * count;
}

/* An exception's number, or 0. */
static unsigned exchanged(uint8_t *frame, size_t length)
{
    if (simulation_exchange(frame, client_close_frame(frame, length)) < 5u) {
        fprintf(stderr, "no answer to function %d at %02x%02x\n", frame[1], frame[2], frame[3]);
        abort();
    }
    return simulation.reply[1] & 0x80u ? simulation.reply[2] : 0;
}

unsigned client_write(uint16_t address, const uint16_t *words, unsigned count)
{
    uint8_t frame[256];
    return exchanged(frame, client_write_frame(frame, address, words, count));
}

unsigned client_write_u32(uint16_t address, uint32_t value)
{
    uint16_t words[2];
    client_put_u32(words, value);
    return client_write(address, words, 2u);
}

/* Words of a register into the reply; gives where they begin. */
static const uint8_t *fetched(uint16_t address, unsigned count)
{
    uint8_t frame[8] = {1u, 3u};
    put_word(&frame[2], address);
    put_word(&frame[4], (uint16_t)count);
    if (exchanged(frame, 6u) != 0) {
        fprintf(stderr, "no register %04x\n", address);
        abort();
    }
    return &simulation.reply[3];
}

uint16_t client_u16(uint16_t address)
{
    const uint8_t *bytes = fetched(address, 1u);
    return (uint16_t)((unsigned)bytes[0] << 8 | bytes[1]);
}

uint32_t client_u32(uint16_t address)
{
    const uint8_t *bytes = fetched(address, 2u);
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

float client_f32(uint16_t address)
{
    const uint32_t raw = client_u32(address);
    float value;
    memcpy(&value, &raw, sizeof value);
    return value;
}

void client_put_u32(uint16_t *words, uint32_t value)
{
    words[0] = (uint16_t)(value >> 16);
    words[1] = (uint16_t)value;
}

void client_put_f32(uint16_t *words, float value)
{
    uint32_t raw;
    memcpy(&raw, &value, sizeof raw);
    client_put_u32(words, raw);
}

void client_command_words(uint16_t words[COMMAND_WORDS], enum fd_opcode opcode, uint32_t argument,
                        uint32_t key)
{
    words[0] = (uint16_t)opcode;
    words[1] = ++simulation.token;
    client_put_u32(&words[2], argument);
    client_put_u32(&words[4], key);
}

enum fd_result client_command(enum fd_opcode opcode, uint32_t argument)
{
    uint16_t words[COMMAND_WORDS];
    client_command_words(words, opcode, argument, CLIENT_KEY);
    if (client_write(FD_REG_COMMAND_OPCODE, words, COMMAND_WORDS) != 0) {
        fprintf(stderr, "command %d refused as a write\n", (int)opcode);
        abort();
    }
    return (enum fd_result)client_u16(FD_REG_STATUS_LAST_RESULT);
}

void client_begin_table(uint16_t table[TABLE_WORDS], enum fd_trajectorykind kind,
                      uint32_t lead_in_samples, uint32_t capture_samples)
{
    memset(table, 0, TABLE_WORDS * sizeof *table);
    table[0] = (uint16_t)kind;
    client_put_u32(&table[FD_REG_TRAJECTORY_LEAD_IN_SAMPLES - TABLE_ADDRESS], lead_in_samples);
    client_put_u32(&table[FD_REG_TRAJECTORY_CAPTURE_SAMPLES - TABLE_ADDRESS], capture_samples);
}

static uint16_t *entry(uint16_t *table, unsigned axis, uint16_t x_address)
{
    return &table[x_address - TABLE_ADDRESS + axis * TABLE_AXIS_STRIDE];
}

void client_set_f32(uint16_t table[TABLE_WORDS], unsigned axis, uint16_t x_address, unsigned n,
                  float value)
{
    client_put_f32(entry(table, axis, x_address) + 2u * n, value);
}

void client_set_u16(uint16_t table[TABLE_WORDS], unsigned axis, uint16_t x_address, uint16_t value)
{
    *entry(table, axis, x_address) = value;
}

bool client_write_table(const uint16_t table[TABLE_WORDS])
{
    static const struct {
        uint16_t first, end;
    } runs[] = {
        {FD_REG_TRAJECTORY_KIND, FD_REG_TRAJECTORY_CAPTURE_SAMPLES + 2u},
        {FD_REG_TRAJECTORY_X_COMPONENTS, FD_REG_TRAJECTORY_X_ACCELERATION + 2u},
        {FD_REG_TRAJECTORY_Z_COMPONENTS, FD_REG_TRAJECTORY_Z_ACCELERATION + 2u},
    };
    for (size_t n = 0; n < sizeof runs / sizeof runs[0]; n++) {
        const unsigned count = (unsigned)(runs[n].end - runs[n].first);
        if (client_write(runs[n].first, &table[runs[n].first - TABLE_ADDRESS], count) != 0) {
            return false;
        }
    }
    return true;
}

uint32_t client_table_crc(const uint16_t table[TABLE_WORDS])
{
    return crc32_of_words(table, TABLE_WORDS);
}

/* ---- gains */

void client_bank_words(const struct fd_gain_bank gains[FD_AXES], uint16_t words[BANK_WORDS])
{
    const unsigned floats = sizeof gains[0] / sizeof(float), first = FIRST_BANK_WORDS / 2u / FD_AXES;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        float row[sizeof(struct fd_gain_bank) / sizeof(float)];
        memcpy(row, &gains[axis], sizeof row);
        for (unsigned n = 0; n < floats; n++) {
            const unsigned early = axis * first + n;
            const unsigned late = FD_AXES * first + axis * (floats - first) + n - first;
            client_put_f32(&words[2u * (n < first ? early : late)], row[n]);
        }
    }
}

struct client_piece client_staged_piece(unsigned n)
{
    struct client_piece piece = {FD_REG_SHADOW_X_PROPORTIONAL, 0, FIRST_BANK_WORDS};
    if (n > 0) {
        const unsigned later = (n - 1u) * STAGED_WORDS;
        piece.address = (uint16_t)(FD_REG_SHADOW_X_FRICTION_TOP_SPEED + later);
        piece.first = FIRST_BANK_WORDS + later;
        piece.count = STAGED_WORDS;
    }
    return piece;
}

uint32_t client_stage(const struct fd_gain_bank gains[FD_AXES])
{
    uint16_t words[BANK_WORDS];
    unsigned refusals = 0;
    client_bank_words(gains, words);
    for (unsigned n = 0; n < STAGED_WRITES; n++) {
        const struct client_piece piece = client_staged_piece(n);
        refusals += client_write(piece.address, &words[piece.first], piece.count);
    }
    const uint32_t crc = crc32_of_words(words, BANK_WORDS);
    refusals += client_write_u32(FD_REG_SHADOW_CRC, crc);
    return refusals == 0 ? crc : 0;
}
