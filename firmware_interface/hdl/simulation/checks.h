// What the checks share: the encoders' and the program's side of the FPGA. fpga_checks.cpp runs them.
#ifndef CHECKS_H
#define CHECKS_H

#include "fpga_model.h"

extern "C" {
#include "../../reference_firmware/linux/default_settings.h"
#include "../../reference_firmware/port.h"
#include "../port_fpga.h"
}

#define CHECK(condition) check(condition, #condition, __LINE__)

inline constexpr unsigned SAMPLE_US = 2500, TAKE_OVER_US = 300, WATCHDOG_US = 10000;

extern int turning[2]; // edges of the encoders every four cycles: 1 forwards, -1 backwards
extern unsigned long cycles; // since power-up

// Ends the program where it does not hold.
void check(bool holds, const char *text, int line);

void run(unsigned long count); // cycles
void turn(unsigned axis, int edges); // at once
void to_next_sample();

// What the firmware does in its sample interrupt.
void sample(int16_t x, int16_t z, bool enabled);

// As the next sample latches it.
int32_t position(unsigned axis);

// Effort on, and in force.
void enable(int16_t x, int16_t z);

// How many cycles of the next so many have a pulse.
unsigned long pulses_of(unsigned axis, unsigned long count);

void check();
void counters_count_up_and_down();
void both_counts_and_the_time_are_latched_at_one_edge();
void a_tick_between_two_reads_mixes_no_samples();
void counters_wrap_around();
void a_lost_count_stops_the_effort_and_is_remembered();
void without_enable_no_pulse_leaves();
void density_of_pulses_is_the_effort();
void effort_saturates_at_the_limit();
void efforts_come_into_force_together_and_on_time();
void counters_cannot_be_set_while_enabled();
void the_watchdog_drops_the_effort_when_nobody_feeds_it();
void a_program_that_runs_in_a_circle_does_not_feed();
void the_stop_needs_no_clock_and_stays_latched();
void a_stop_between_two_clock_edges_is_seen();
void switches_are_told();

#endif
