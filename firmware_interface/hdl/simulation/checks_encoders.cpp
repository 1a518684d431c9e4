// The encoders' counters and their latch.
#include "checks.h"

void counters_count_up_and_down()
{
    CHECK(position(0) == 0);
    for (unsigned axis = 0; axis < 2; axis++) {
        turning[axis] = 1;
        run(4 * 100);
        turning[axis] = -1;
        run(4 * 130);
        turning[axis] = 0;
        CHECK(position(axis) == -30);
    }
}

void both_counts_and_the_time_are_latched_at_one_edge()
{
    turning[0] = turning[1] = 1; // the same edges on both axes: the counts are equal at all times
    int32_t last = position(0);
    uint32_t last_us = fpga_read(FPGA_STAMP);
    for (unsigned n = 0; n < 20; n++) {
        to_next_sample();
        const uint32_t x = fpga_read(FPGA_COUNT_X), us = fpga_read(FPGA_STAMP);
        run(SAMPLE_US / 2);
        CHECK(fpga_read(FPGA_COUNT_Z) == x);
        CHECK(fpga_read(FPGA_COUNT_X) == x && fpga_read(FPGA_STAMP) == us);
        CHECK(us - last_us == SAMPLE_US);
        CHECK(static_cast<int32_t>(x) - last == static_cast<int32_t>(SAMPLE_US / 4));
        last = static_cast<int32_t>(x);
        last_us = us;
    }
}

void a_tick_between_two_reads_mixes_no_samples()
{
    turning[0] = turning[1] = 1;
    for (unsigned early = 0; early < 10; early++) {
        int32_t counts[2];
        to_next_sample();
        run(SAMPLE_US - early); // the next tick falls into the reads
        port_read_encoders(counts);
        CHECK(counts[0] == counts[1] && counts[0] != 0);
    }
}

void counters_wrap_around()
{
    fpga_write(FPGA_COUNT_X, INT32_MAX);
    fpga_write(FPGA_COUNT_Z, static_cast<uint32_t>(INT32_MIN));
    turn(0, 1);
    turn(1, -1);
    CHECK(position(0) == INT32_MIN);
    CHECK(position(1) == INT32_MAX);
}

void a_lost_count_stops_the_effort_and_is_remembered()
{
    port_fpga_open(3);
    enable(1000, 1000);
    CHECK(fpga_model.brake_release && !port_sto_latched());
    turn(1, 2); // both tracks at once
    run(5);
    CHECK(!fpga_model.brake_release && pulses_of(0, 1000) + pulses_of(1, 1000) == 0);
    CHECK(port_sto_latched() && !port_sto_active());
    CHECK(port_homed() == 3);
    port_sto_rearm();
    CHECK(!port_sto_latched() && port_homed() == 1);
}
