#include "fuzz_targets.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../crc.h"
#include "../gain_banks.h"
#include "../machine.h"
#include "client.h"
#include "fuzz_invariants.h"
#include "fuzz_plays.h"
#include "fuzz_values.h"
#include "simulation.h"

#define GAINS_AT 8u /* in a record of the store; before them the map's CRC and the sequence */
#define RECORD_BYTES (GAINS_AT + FD_AXES * sizeof(struct fd_gain_bank))
#define MAP_3_CRC 0x58329fe3u
#define MAP_3_BYTES offsetof(struct fd_gain_bank, friction_top_speed)

static void require(bool holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "broken: %s\n", what);
        abort();
    }
}

/* ---- frames: any bytes in bursts on the line, most of them whole by their CRC */

static void frames(void)
{
    while (!fuzz_exhausted()) {
        uint8_t burst[2u * 256u + 4u];
        size_t length = 0;
        for (unsigned frame = fuzz_rarely(4) ? 2u : 1u; frame > 0; frame--) {
            const size_t begun = length;
            for (unsigned left = fuzz_below(256); left > 0; left--) {
                burst[length++] = (uint8_t)fuzz_below(256);
            }
            if (!fuzz_rarely(4)) {
                length = begun + client_close_frame(&burst[begun], length - begun);
            }
        }
        simulation_exchange(burst, length);
        simulation_samples(fuzz_below(4));
    }
}

/* ---- store: records as the board would have left them, with other bytes in them */

static uint32_t crc_of_record(const unsigned char *record, size_t size)
{
    uint32_t crc = 0;
    for (size_t at = 0; at < size; at += 2u) {
        uint16_t word;
        memcpy(&word, &record[at], sizeof word);
        crc = crc32_of_more(crc, &word, 1u);
    }
    return crc;
}

static void put_record(unsigned char *record, bool of_map_3)
{
    const uint32_t map_crc = of_map_3 ? MAP_3_CRC : FD_MAP_CRC;
    const size_t of_axis = of_map_3 ? MAP_3_BYTES : sizeof(struct fd_gain_bank);
    memcpy(record, &map_crc, sizeof map_crc);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        memcpy(&record[GAINS_AT + axis * of_axis], &simulation.settings.axis[axis].first_gains,
               of_axis);
    }
    const size_t size = GAINS_AT + FD_AXES * of_axis;
    for (unsigned left = fuzz_below(16); left > 0; left--) { /* before the CRC, or after it */
        record[fuzz_below((uint32_t)size)] = (uint8_t)fuzz_below(256);
    }
    const uint32_t crc = crc_of_record(record, size);
    memcpy(&record[size], &crc, sizeof crc);
    if (fuzz_rarely(4)) {
        record[fuzz_below((uint32_t)(size + sizeof crc))] ^= (unsigned char)(1u << fuzz_below(8));
    }
}

static void store(void)
{
    for (unsigned slot = 0; slot < STORE_SLOTS; slot++) {
        if (!fuzz_rarely(4)) {
            put_record(simulation.memory[slot], fuzz_rarely(3));
        }
    }
    simulation_power_cycle();
    require(gain_banks_within_maxima(gain_banks_active()), "gains in force beyond their maxima");
    simulation_samples(30u);
    client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY);
    struct fd_gain_bank gains[FD_AXES];
    memcpy(gains, gain_banks_active(), sizeof gains);
    fuzz_gains(&gains[0], &simulation.settings.axis[0].gain_maximum);
    if (client_command(FD_OPCODE_COMMIT, client_stage(gains)) == FD_RESULT_DONE) {
        client_command(FD_OPCODE_CONFIRM, 0);
    }
    memcpy(gains, gain_banks_active(), sizeof gains);
    simulation.memory_fails = fuzz_rarely(4);
    if (client_command(FD_OPCODE_STORE, FD_STORE_SIGNATURE) == FD_RESULT_DONE) {
        simulation_power_cycle();
        require(memcmp(gains, gain_banks_active(), sizeof gains) == 0, "stored gains are others");
    }
}

/* ---- values: tables and gains of any numbers, whole by their CRC, in a motion */

static void put_number(uint16_t *words, uint32_t count)
{
    const uint32_t at = fuzz_below(count - 1u);
    client_put_u32(&words[at], fuzz_random());
}

static void any_gains(void)
{
    struct fd_gain_bank gains[FD_AXES];
    memcpy(gains, gain_banks_active(), sizeof gains);
    for (unsigned left = fuzz_below(8); left > 0; left--) {
        struct fd_gain_bank *of_axis = &gains[fuzz_below(FD_AXES)];
        const uint32_t at = fuzz_below(sizeof *of_axis / sizeof(float));
        const float number = fuzz_rarely(2) ? fuzz_hostile() : fuzz_between(0.0f, 5.0f);
        memcpy((unsigned char *)of_axis + at * sizeof number, &number, sizeof number);
    }
    const uint32_t crc = client_stage(gains);
    client_command(fuzz_rarely(2) ? FD_OPCODE_COMMIT_RUNNING : FD_OPCODE_COMMIT, crc);
    simulation_samples(fuzz_below(64));
    client_command(fuzz_rarely(3) ? FD_OPCODE_ROLL_BACK : FD_OPCODE_CONFIRM, 0);
}

static void any_table(void)
{
    uint16_t table[TABLE_WORDS];
    fuzz_table(table);
    for (unsigned left = fuzz_below(4); left > 0; left--) {
        put_number(table, TABLE_WORDS);
    }
    client_command(FD_OPCODE_ENABLE, 0);
    client_write_table(table);
    client_command(FD_OPCODE_ARM, client_table_crc(table));
    for (unsigned n = 0; n < 400u && machine.state == FD_STATE_CHECKING; n++) {
        simulation_pass(200u);
    }
    client_command(FD_OPCODE_START, FD_MAP_CRC);
    for (unsigned left = fuzz_below(64); left > 0; left--) {
        simulation_samples(40u);
        client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY);
    }
    client_command(FD_OPCODE_QUICK_STOP, 0);
    simulation_samples(300u);
    client_command(FD_OPCODE_CLEAR_FAULT, 0);
}

static void values(void)
{
    simulation_samples(30u);
    for (unsigned left = 8u; left > 0 && !fuzz_exhausted(); left--) {
        client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY);
        if (fuzz_rarely(2)) {
            any_gains();
        } else {
            any_table();
        }
    }
}

static void (*target(void))(void)
{
    static const struct {
        const char *name;
        void (*run)(void);
    } targets[] = {{"frames", frames}, {"plays", fuzz_plays}, {"store", store}, {"values", values}};
    const char *name = getenv("FUZZ_TARGET");
    for (size_t n = 0; name != NULL && n < sizeof targets / sizeof targets[0]; n++) {
        if (strcmp(name, targets[n].name) == 0) {
            return targets[n].run;
        }
    }
    fprintf(stderr, "FUZZ_TARGET is one of frames, plays, store, values\n");
    exit(2);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length)
{
    fuzz_choose_from(bytes, length);
    simulation_reset();
    invariants_watch();
    simulation_power_cycle();
    target()();
    return 0;
}
