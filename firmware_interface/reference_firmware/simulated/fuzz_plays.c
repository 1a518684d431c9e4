#include "fuzz_plays.h"

#include <string.h>

#include "../capture_ring.h"
#include "../crc.h"
#include "../gain_banks.h"
#include "../machine.h"
#include "../register_file.h"
#include "../session.h"
#include "client.h"
#include "fuzz_accidents.h"
#include "fuzz_values.h"
#include "simulation.h"

#define LONGEST_US 30000000u

static uint32_t table_crc; /* of the trajectory written last */
static uint32_t bank_crc; /* of the gains staged last */

/* ---- on the line */

/* A frame without its CRC; some are damaged on their way, or come twice. */
static void send(uint8_t frame[1024], size_t length)
{
    length = client_close_frame(frame, length);
    if (fuzz_rarely(60)) {
        frame[fuzz_below((uint32_t)length)] ^= (uint8_t)(1u << fuzz_below(8));
    }
    if (fuzz_rarely(100)) {
        length = 1u + fuzz_below((uint32_t)length);
    }
    if (fuzz_rarely(100)) {
        memcpy(&frame[length], frame, length);
        length *= 2u;
    }
    simulation_exchange(frame, length);
}

static void write_words(uint16_t address, const uint16_t *words, unsigned count)
{
    uint8_t frame[1024];
    send(frame, client_write_frame(frame, address, words, count));
}

static uint32_t any_key(void)
{
    static const uint32_t keys[] = {CLIENT_KEY, 1u, 0u};
    return fuzz_rarely(3) ? keys[fuzz_below(3)] : fuzz_rarely(4) ? session_key() : CLIENT_KEY;
}

static void command(enum fd_opcode opcode, uint32_t argument)
{
    uint16_t words[COMMAND_WORDS];
    client_command_words(words, opcode, argument, fuzz_rarely(20) ? any_key() : CLIENT_KEY);
    write_words(FD_REG_COMMAND_OPCODE, words, COMMAND_WORDS);
}

/* ---- frames */

static void noise(void)
{
    uint8_t bytes[1024];
    const size_t length = 1u + fuzz_below(400);
    for (size_t n = 0; n < length; n++) {
        bytes[n] = (uint8_t)fuzz_random();
    }
    simulation_exchange(bytes, length);
}

/* Any function with any contents, whole by its CRC. */
static void any_frame(void)
{
    uint8_t frame[1024] = {1u, (uint8_t)fuzz_random()};
    const size_t length = 2u + fuzz_below(250);
    for (size_t n = 2u; n < length; n++) {
        frame[n] = (uint8_t)fuzz_random();
    }
    send(frame, length);
}

/* Reading and writing at the places where there is something. */
static void any_request(void)
{
    static const uint16_t places[] = {
        0x0000, 0x0040, 0x0052, 0x0080, 0x008e, 0x0090, 0x00a0, 0x0100, 0x0110, 0x0170, 0x0200,
        0x0300, 0x0380, 0x03e0, 0x1000, 0x8f80, 0xfff0,
    };
    const uint16_t place = places[fuzz_below(sizeof places / sizeof places[0])];
    const unsigned count = fuzz_below(130);
    const uint16_t address = (uint16_t)(place + fuzz_below(8));
    uint8_t frame[1024];
    uint16_t words[130];
    for (unsigned n = 0; n < count; n++) {
        words[n] = (uint16_t)(fuzz_rarely(3) ? fuzz_random() : fuzz_below(12));
    }
    size_t length = client_write_frame(frame, address, words, count);
    frame[1] = (uint8_t)(fuzz_rarely(2) ? 3u : fuzz_rarely(2) ? 6u : 16u);
    if (frame[1] != 16u) {
        length = 6u;
    } else if (fuzz_rarely(10)) {
        frame[6] = (uint8_t)fuzz_random();
    }
    send(frame, length);
}

/* ---- the host's verbs, in any order */

static void any_command(void)
{
    const uint32_t arguments[] = {0, FD_MAP_CRC, FD_STORE_SIGNATURE, table_crc, bank_crc,
                                  fuzz_random()};
    uint16_t words[COMMAND_WORDS];
    client_command_words(words, (enum fd_opcode)fuzz_below(14), arguments[fuzz_below(6)],
                         any_key());
    if (fuzz_rarely(10)) {
        words[1] = (uint16_t)(words[1] - fuzz_below(100)); /* a token seen before */
    }
    write_words(FD_REG_COMMAND_OPCODE, words, COMMAND_WORDS);
}

/* The key, and mostly the pages that the host holds. */
static void heartbeat(void)
{
    uint16_t words[4];
    const uint32_t pages = capture_ring_counters().pages_written;
    client_put_u32(words, fuzz_rarely(20) ? any_key() : CLIENT_KEY);
    client_put_u32(&words[2], fuzz_rarely(10) ? pages + fuzz_below(5) - 2u : pages);
    write_words(FD_REG_SESSION_KEY, words, fuzz_rarely(5) ? 2u : 4u);
}

static void release(void)
{
    uint16_t words[2];
    client_put_u32(words, any_key());
    write_words(FD_REG_SESSION_RELEASE, words, 2u);
}

/* Anything that is allowed; in a motion, nothing is. */
static void set_watchdog(void)
{
    const uint16_t words[] = {(uint16_t)(100u + fuzz_below(3000)), (uint16_t)(1u + fuzz_below(2))};
    write_words(FD_REG_WATCHDOG_TIMEOUT, words, 2u);
}

static void write_table(void)
{
    uint16_t table[TABLE_WORDS];
    fuzz_table(table);
    table_crc = client_table_crc(table);
    client_write_table(table);
}

static void stage_and_commit(void)
{
    struct fd_gain_bank gains[FD_AXES];
    uint16_t words[BANK_WORDS], crc[2];
    memcpy(gains, gain_banks_active(), sizeof gains);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        fuzz_gains(&gains[axis], &simulation.settings.axis[axis].gain_maximum);
    }
    client_bank_words(gains, words);
    bank_crc = crc32_of_words(words, BANK_WORDS);
    client_put_u32(crc, bank_crc);
    for (unsigned n = 0; n < STAGED_WRITES; n++) {
        const struct client_piece piece = client_staged_piece(n);
        write_words(piece.address, &words[piece.first], piece.count);
    }
    write_words(FD_REG_SHADOW_CRC, crc, 2u);
    command(fuzz_rarely(2) ? FD_OPCODE_COMMIT_RUNNING : FD_OPCODE_COMMIT, bank_crc);
    if (!fuzz_rarely(3)) {
        command(fuzz_rarely(3) ? FD_OPCODE_ROLL_BACK : FD_OPCODE_CONFIRM, 0);
        command(FD_OPCODE_STORE, FD_STORE_SIGNATURE);
    }
}

/* ---- a host's whole work, and what may come in between */

static void accident(void)
{
    static void (*const accidents[])(void) = {
        noise, any_frame, any_request, any_command, release, write_table, fuzz_inputs,
        fuzz_inputs, fuzz_wait, stage_and_commit, any_command, set_watchdog, fuzz_power,
    };
    accidents[fuzz_below(sizeof accidents / sizeof accidents[0])]();
}

static void get_ready(void)
{
    heartbeat();
    if (machine.state == FD_STATE_FAULT) {
        simulation_press_stop(false);
        command(FD_OPCODE_CLEAR_FAULT, 0);
    }
    if (machine.state != FD_STATE_IDLE) {
        command(FD_OPCODE_QUICK_STOP, 0);
        simulation_samples(150);
    }
    simulation_samples(30);
    command(FD_OPCODE_ENABLE, 0);
}

enum host { DILIGENT, FORGETFUL, DEAD }; /* acknowledges, only beats, is silent */

/* Until the motion has ended, or the host loses patience. */
static void see_through(enum host host)
{
    uint16_t key[2];
    client_put_u32(key, CLIENT_KEY);
    for (unsigned n = 0; n < (host == FORGETFUL ? 200u : 80u) && machine_in_motion(); n++) {
        simulation_samples(fuzz_below(60));
        if (host == DILIGENT && !fuzz_rarely(10)) {
            heartbeat();
        } else if (host == FORGETFUL) {
            write_words(FD_REG_SESSION_KEY, key, 2u);
        }
        if (fuzz_rarely(20)) {
            accident();
        }
        if (machine.state == FD_STATE_DRAINING && fuzz_rarely(4)) {
            stage_and_commit();
        }
    }
}

static void motion(void)
{
    get_ready();
    write_table();
    command(FD_OPCODE_ARM, fuzz_rarely(30) ? fuzz_random() : table_crc);
    for (unsigned n = 0; n < 400u && machine.state == FD_STATE_CHECKING; n++) {
        simulation_pass(200u);
    }
    if (fuzz_rarely(20)) { /* while gains may be rolled back, and the lease runs out */
        simulation_samples(1000u + fuzz_below(1500));
    }
    command(FD_OPCODE_START, FD_MAP_CRC);
    see_through(fuzz_rarely(10) ? DEAD : fuzz_rarely(10) ? FORGETFUL : DILIGENT);
    command(fuzz_rarely(3) ? FD_OPCODE_QUICK_STOP : FD_OPCODE_FINISH, 0);
    if (fuzz_rarely(5)) {
        command(FD_OPCODE_DISABLE, 0);
    }
}

void fuzz_plays(void)
{
    static void (*const plays[])(void) = {
        motion, get_ready, stage_and_commit, any_command, heartbeat, fuzz_inputs, fuzz_wait,
        any_request, any_frame, noise, release, write_table, set_watchdog, fuzz_power,
    };
    const uint32_t begun_us = simulation.time_us;
    table_crc = bank_crc = 0;
    while (!fuzz_exhausted() && simulation.time_us - begun_us < LONGEST_US) {
        plays[fuzz_below(sizeof plays / sizeof plays[0])]();
    }
}
