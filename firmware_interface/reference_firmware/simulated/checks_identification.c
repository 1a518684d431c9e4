/* Checks of the board's own identification: it lets others work, and ends with its motion. */
#include "checks.h"

#include "../host_requests.h"
#include "../identification.h"
#include "client.h"
#include "simulation.h"

#ifdef FD_IDENTIFICATION

#include <math.h>

#include "identification_network.h"

#define FIRST_TOKEN 7u
#define SECOND_TOKEN 8u
#define PERIOD_SAMPLES ((uint32_t)(NETWORK_PERIOD_S / (SAMPLE_PERIOD_NS * 1e-9)))
#define TURN 6.283185307179586
#define VISCOUS_COUNTS 360.0
#define COULOMB_COUNTS 300.0

static unsigned long pauses, begin_at;

/* As a host's request reads it. */
static uint16_t read_now(uint16_t address)
{
    uint16_t word = 0;
    CHECK(host_read(address, 1u, &word) == ACCESS_DONE);
    return word;
}

/* The motion that the network was trained for, of a drive with friction. */
static void capture_a_motion(void)
{
    const double turn_counts = simulation.settings.counts_per_turn;
    identification_begin(FIRST_TOKEN, PERIOD_SAMPLES);
    for (uint32_t n = 0; n < PERIOD_SAMPLES; n++) {
        struct drive_sample sample = {0};
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            const double angle = TURN * ((double)n / PERIOD_SAMPLES + 0.25 * axis);
            sample.position[axis] = (int32_t)lround(turn_counts * sin(angle));
            sample.effort[axis] = (int16_t)lround(
                VISCOUS_COUNTS * cos(angle) + copysign(COULOMB_COUNTS, cos(angle)));
        }
        identification_add(&sample);
    }
    identification_captured();
}

static void count_and_look(void)
{
    pauses++;
    CHECK(read_now(FD_REG_IDENTIFICATION_STATE) == FD_IDENTIFICATIONSTATE_RUNNING);
    CHECK(read_now(FD_REG_IDENTIFICATION_X_IMAGES) == 0);
}

static void count_and_begin_another(void)
{
    pauses++;
    if (pauses == begin_at) {
        identification_begin(SECOND_TOKEN, PERIOD_SAMPLES);
    }
}

static unsigned long computed(void (*at_each_pause)(void))
{
    pauses = 0;
    simulation_power_cycle();
    capture_a_motion();
    identification_go_on(at_each_pause);
    return pauses;
}

static void it_answers_while_it_computes(void)
{
    CHECK(computed(count_and_look) > 100u);
    CHECK(read_now(FD_REG_IDENTIFICATION_STATE) == FD_IDENTIFICATIONSTATE_DONE);
    CHECK(read_now(FD_REG_IDENTIFICATION_MOTION) == FIRST_TOKEN);
    CHECK(read_now(FD_REG_IDENTIFICATION_X_IMAGES) > 0);
}

/* At the first pause, at the last one, and between. */
static void new_motion_ends_computing(void)
{
    const unsigned long all = computed(count_and_look);
    const unsigned long places[] = {1u, all / 2u, all};
    for (unsigned n = 0; n < sizeof places / sizeof places[0]; n++) {
        begin_at = places[n];
        CHECK(computed(count_and_begin_another) <= begin_at + all / 100u); /* less than an image */
        CHECK(read_now(FD_REG_IDENTIFICATION_STATE) == FD_IDENTIFICATIONSTATE_CAPTURING);
        CHECK(read_now(FD_REG_IDENTIFICATION_MOTION) == SECOND_TOKEN);
        CHECK(read_now(FD_REG_IDENTIFICATION_X_IMAGES) == 0);
        identification_idle();
        CHECK(read_now(FD_REG_IDENTIFICATION_STATE) == FD_IDENTIFICATIONSTATE_FAILED);
        CHECK(read_now(FD_REG_IDENTIFICATION_X_REASON) == FD_IDENTIFICATIONREASON_STOPPED);
    }
}

const struct check identification_checks[] = {
    {"it_answers_while_it_computes", it_answers_while_it_computes},
    {"new_motion_ends_computing", new_motion_ends_computing},
};

#else

static void board_without_a_network_says_nothing(void)
{
    check_set_up();
    for (uint16_t at = FD_REG_IDENTIFICATION_STATE; at < FD_REG_IDENTIFICATION_CRC + 2u; at++) {
        CHECK(client_u16(at) == 0);
    }
}

const struct check identification_checks[] = {
    {"board_without_a_network_says_nothing", board_without_a_network_says_nothing},
};

#endif

const unsigned identification_check_count =
    sizeof identification_checks / sizeof identification_checks[0];
