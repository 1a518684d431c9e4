// Looks at the FPGA's pins, cycle by cycle, while the port layer works its registers: one check by
// name, or the list of names.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "checks.h"

int turning[2];
unsigned long cycles;
static struct board_settings settings;
static unsigned phase[2]; // of the encoders
static unsigned long pulses[2];

const struct board_settings *port_settings()
{
    return &settings;
}

void check(bool holds, const char *text, int line)
{
    if (!holds) {
        std::fprintf(stderr, "line %d: %s\n", line, text);
        std::exit(EXIT_FAILURE);
    }
}

void turn(unsigned axis, int edges)
{
    static const unsigned tracks[] = {0, 1, 3, 2}; // bit 0 is A, bit 1 is B: A leads
    phase[axis] = (phase[axis] + static_cast<unsigned>(edges)) % 4;
    const unsigned pair = tracks[phase[axis]], other = 1u - axis;
    fpga_model.track_a = (fpga_model.track_a & 1u << other) | (pair & 1u) << axis;
    fpga_model.track_b = (fpga_model.track_b & 1u << other) | (pair >> 1u) << axis;
}

static void before_cycle()
{
    cycles++;
    for (unsigned axis = 0; axis < 2; axis++) {
        pulses[axis] += fpga_model.pulse >> axis & 1u;
        if (cycles % 4 == 0) {
            turn(axis, turning[axis]);
        }
    }
}

void run(unsigned long count)
{
    for (; count > 0; count--) {
        fpga_cycle();
    }
}

void to_next_sample()
{
    while (!fpga_interrupt.exchange(false)) {
        fpga_cycle();
    }
}

void sample(int16_t x, int16_t z, bool enabled)
{
    const int16_t efforts[2] = {x, z};
    int32_t counts[2];
    to_next_sample();
    port_read_encoders(counts);
    port_write_effort(efforts);
    port_release_brake(enabled);
}

int32_t position(unsigned axis)
{
    int32_t counts[2];
    to_next_sample();
    port_read_encoders(counts);
    return counts[axis];
}

unsigned long pulses_of(unsigned axis, unsigned long count)
{
    const unsigned long so_far = pulses[axis];
    run(count);
    return pulses[axis] - so_far;
}

void enable(int16_t x, int16_t z)
{
    sample(0, 0, true); // a gate that is closed takes no effort
    sample(x, z, true);
    run(SAMPLE_US / 2); // past the take-over
}

#define NAMED(check) {#check, check}
static const struct {
    const char *name;
    void (*check)();
} CHECKS[] = {
    NAMED(counters_count_up_and_down),
    NAMED(both_counts_and_the_time_are_latched_at_one_edge),
    NAMED(a_tick_between_two_reads_mixes_no_samples),
    NAMED(counters_wrap_around),
    NAMED(a_lost_count_stops_the_effort_and_is_remembered),
    NAMED(without_enable_no_pulse_leaves),
    NAMED(density_of_pulses_is_the_effort),
    NAMED(effort_saturates_at_the_limit),
    NAMED(efforts_come_into_force_together_and_on_time),
    NAMED(counters_cannot_be_set_while_enabled),
    NAMED(the_watchdog_drops_the_effort_when_nobody_feeds_it),
    NAMED(a_program_that_runs_in_a_circle_does_not_feed),
    NAMED(the_stop_needs_no_clock_and_stays_latched),
    NAMED(a_stop_between_two_clock_edges_is_seen),
    NAMED(switches_are_told),
};

int main(int count, char **words)
{
    settings.effort_per_count_nm = static_cast<float>(EFFORT_PER_COUNT_NM);
    for (auto &axis : settings.axis) {
        axis = default_axis;
    }
    fpga_before_cycle = before_cycle;
    fpga_power_up();
    check(port_fpga_open(0) && !fpga_model.brake_release && !port_sto_latched(), "power-up", 0);
    for (const auto &one : CHECKS) {
        if (count < 2) {
            std::puts(one.name);
        } else if (std::strcmp(one.name, words[1]) == 0) {
            one.check();
            return EXIT_SUCCESS;
        }
    }
    return count < 2 ? EXIT_SUCCESS : EXIT_FAILURE;
}
