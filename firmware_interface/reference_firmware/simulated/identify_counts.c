/* The identification alone, of counts from a file: what tells whether it finds what Python finds.
 *
 * From stdin: encoder counts per turn (u32), torque of a PWM count (f32), control delay in ns (u32),
 * samples to come (u32), and for each of them the position (i32) and the effort (i32) of every axis.
 * To stdout: the registers of the identification as words, and microseconds of processor time. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "../board.h"
#include "../host_requests.h"
#include "../identification.h"
#include "simulation.h"

#define WORDS (FD_REG_IDENTIFICATION_CRC + 2u - FD_REG_IDENTIFICATION_STATE)
#define TOKEN 7u

static unsigned long pauses;

static void pause_counted(void)
{
    pauses++;
}

static uint32_t take(void)
{
    uint32_t value;
    if (fread(&value, sizeof value, 1, stdin) != 1) {
        fputs("too few numbers\n", stderr);
        exit(EXIT_FAILURE);
    }
    return value;
}

static void take_settings(void)
{
    simulation.settings.counts_per_turn = take();
    if (fread(&simulation.settings.effort_per_count_nm, sizeof(float), 1, stdin) != 1) {
        exit(EXIT_FAILURE);
    }
    simulation.settings.control_delay_ns = take();
}

static void take_capture(void)
{
    const uint32_t samples = take();
    identification_begin(TOKEN, samples);
    for (uint32_t n = 0; n < samples; n++) {
        struct drive_sample sample;
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            sample.position[axis] = (int32_t)take();
            sample.effort[axis] = (int16_t)(int32_t)take();
        }
        identification_add(&sample);
    }
    identification_captured();
}

int main(void)
{
    uint16_t words[WORDS];
    simulation_reset();
    take_settings();
    simulation_power_cycle();
    take_capture();
    const clock_t begin = clock();
    identification_go_on(pause_counted);
    const double used_us = 1e6 * (double)(clock() - begin) / CLOCKS_PER_SEC;
    if (host_read(FD_REG_IDENTIFICATION_STATE, WORDS, words) != ACCESS_DONE) {
        return EXIT_FAILURE;
    }
    for (unsigned n = 0; n < WORDS; n++) {
        printf("%u ", (unsigned)words[n]);
    }
    printf("\n%.0f %lu\n", used_us, pauses);
    return EXIT_SUCCESS;
}
