/* Runs the firmware's identification on a Cortex-M in QEMU, of the counts in capture.h. Prints the
 * registers of the identification, then the instructions of the whole, the most of them between two
 * pauses, and the stack. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "capture.h"
#include "host_requests.h"
#include "identification.h"
#include "port.h"
#include "register_file.h"

#define STACK_BYTES 16384u
#include "bare_metal.h"

#define WORDS (FD_REG_IDENTIFICATION_CRC + 2u - FD_REG_IDENTIFICATION_STATE)

static uint32_t last_tick, most_ticks;
static uint64_t ticks;

static void pause(void)
{
    const uint32_t now = TICK;
    const uint32_t passed = (last_tick - now) & TICKS;
    ticks += passed;
    most_ticks = passed > most_ticks ? passed : most_ticks;
    last_tick = TICK;
}

/* ---- the port */

const struct board_settings *port_settings(void)
{
    static const struct board_settings settings = {
        .counts_per_turn = COUNTS_PER_TURN,
        .effort_per_count_nm = EFFORT_PER_COUNT_NM,
        .control_delay_ns = CONTROL_DELAY_NS,
    };
    return &settings;
}

void port_lock(void)
{
}

void port_unlock(void)
{
}

/* ---- the program */

static void add_capture(void)
{
    identification_begin(7u, SAMPLES);
    for (size_t n = 0; n < SAMPLES; n++) {
        struct drive_sample sample;
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            sample.position[axis] = captured[n][2u * axis];
            sample.effort[axis] = (int16_t)captured[n][2u * axis + 1u];
        }
        identification_add(&sample);
    }
    identification_captured();
}

static void program(void)
{
    register_file_init();
    identification_init();
    const uint32_t begin = TICK;
    add_capture();
    print("capture ", ((begin - TICK) & TICKS) * NANOSECONDS_PER_TICK);
    last_tick = TICK;
    identification_go_on(pause);
    pause();
    identification_publish();
    for (uint32_t n = 0; n < WORDS; n++) {
        print("word ", register_u16((uint16_t)(FD_REG_IDENTIFICATION_STATE + n)));
    }
    print("thousands ", (uint32_t)(ticks * NANOSECONDS_PER_TICK / 1000u));
    print("most ", most_ticks * NANOSECONDS_PER_TICK);
}
