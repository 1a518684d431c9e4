// The effort, and what stops it.
#include "checks.h"

void without_enable_no_pulse_leaves()
{
    for (unsigned n = 0; n < 5; n++) {
        sample(3000, -3000, false);
        CHECK(pulses_of(0, 2000) == 0 && !fpga_model.brake_release);
    }
    port_release_brake(true); // what was written before does not come into force now
    run(SAMPLE_US);
    CHECK(fpga_model.brake_release && pulses_of(0, 2000) + pulses_of(1, 2000) == 0);
}

void density_of_pulses_is_the_effort()
{
    enable(100, -2050);
    CHECK(pulses_of(0, 4096) == 100 && !(fpga_model.negative & 1));
    sample(100, -2050, true);
    run(SAMPLE_US / 2);
    CHECK(pulses_of(1, 4096) == 2050 && (fpga_model.negative & 2));
}

void effort_saturates_at_the_limit()
{
    const unsigned limit = static_cast<unsigned>(default_axis.effort_nm / EFFORT_PER_COUNT_NM + 0.5);
    enable(INT16_MAX, INT16_MIN);
    CHECK(pulses_of(0, 4096) == limit && fpga_model.negative == 2);
    fpga_write(FPGA_LIMIT, 0x7FFF7FFFu); // refused while enabled
    sample(INT16_MAX, INT16_MIN, true);
    run(SAMPLE_US / 2);
    CHECK(pulses_of(1, 4096) == limit);
}

void efforts_come_into_force_together_and_on_time()
{
    sample(0, 0, true);
    sample(4095, 4095, true); // clipped to 3000 of 4096: the second cycle has the first pulse
    const uint32_t latched_us = fpga_read(FPGA_STAMP);
    while (fpga_model.pulse == 0) {
        fpga_cycle();
    }
    CHECK(fpga_model.pulse == 3);
    const uint32_t delay_us = fpga_read(FPGA_TIME) - latched_us;
    CHECK(delay_us >= TAKE_OVER_US && delay_us <= TAKE_OVER_US + 5);
}

void counters_cannot_be_set_while_enabled()
{
    enable(0, 0);
    fpga_write(FPGA_COUNT_X, 1234);
    sample(0, 0, true);
    CHECK(position(0) == 0);
}

// Cycles until the effort is off.
static unsigned long until_off()
{
    const unsigned long start = cycles;
    CHECK(fpga_model.brake_release);
    while (fpga_model.brake_release && cycles - start < 10 * WATCHDOG_US) {
        fpga_cycle();
    }
    return cycles - start;
}

void the_watchdog_drops_the_effort_when_nobody_feeds_it()
{
    sample(0, 0, true);
    for (unsigned n = 0; n < 40; n++) { // ten times its time, fed
        sample(3000, 3000, true);
        CHECK(pulses_of(0, 2000) > 0);
    }
    sample(3000, 3000, true);
    const unsigned long off_us = until_off();
    CHECK(off_us <= WATCHDOG_US && off_us > WATCHDOG_US - 5);
    CHECK(pulses_of(0, 5000) + pulses_of(1, 5000) == 0);
    CHECK(port_sto_latched() && !port_sto_active());
    sample(3000, 3000, true); // fed too late: stays off
    CHECK(pulses_of(0, 2000) == 0);
    port_sto_rearm();
    CHECK(!port_sto_latched());
    enable(3000, 3000);
    CHECK(pulses_of(0, 1000) > 0);
}

void a_program_that_runs_in_a_circle_does_not_feed()
{
    enable(3000, 3000);
    const int16_t efforts[2] = {3000, 3000};
    const unsigned long start = cycles;
    while (fpga_model.brake_release && cycles - start < 10 * WATCHDOG_US) {
        port_write_effort(efforts); // answers the same sample for ever
        run(50);
    }
    CHECK(cycles - start <= SAMPLE_US + WATCHDOG_US);
    CHECK(port_sto_latched());
}

void the_stop_needs_no_clock_and_stays_latched()
{
    enable(3000, 3000);
    while (fpga_model.pulse == 0) {
        fpga_cycle();
    }
    fpga_model.sto_n = 0;
    fpga_model.eval(); // no clock edge
    CHECK(fpga_model.pulse == 0 && !fpga_model.brake_release);
    fpga_stop = true;
    sample(3000, 3000, true);
    CHECK(port_sto_active() && port_sto_latched());
    port_sto_rearm(); // the wire wins
    CHECK(port_sto_latched());
    fpga_stop = false;
    sample(3000, 3000, true);
    CHECK(!port_sto_active() && port_sto_latched() && pulses_of(0, 2000) == 0);
    port_sto_rearm();
    CHECK(!port_sto_latched());
}

void a_stop_between_two_clock_edges_is_seen()
{
    enable(3000, 3000);
    fpga_stop_pulse = true;
    fpga_cycle();
    CHECK(!fpga_model.brake_release && port_sto_latched());
}

void switches_are_told()
{
    for (unsigned pressed = 0; pressed < 16; pressed++) {
        fpga_model.switches = static_cast<uint8_t>(pressed);
        run(2 * SAMPLE_US);
        CHECK(port_limit_switches() == pressed);
    }
}
