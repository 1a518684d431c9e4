#include "simulation.h"

#include <math.h>
#include <string.h>

#include "../board.h"
#include "../linux/default_settings.h"

struct simulation simulation;

static uint32_t sampled_us; /* when the last sample was */

void simulation_reset(void)
{
    static const struct plant plant = {0.4, 0.8, 1.2, 0.0, 0.0, 0.0};
    memset(&simulation, 0, sizeof simulation);
    simulation.settings = (struct board_settings){
        .counts_per_turn = COUNTS_PER_TURN,
        .effort_per_count_nm = (float)EFFORT_PER_COUNT_NM,
        .frame_gap_us = LINE_GAP_US,
        .turnaround_us = LINE_GAP_US,
        .confirm_window_us = 2000000u,
    };
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        simulation.settings.axis[axis] = default_axis;
        simulation.plants[axis] = plant;
    }
    simulation.time_us = UINT32_MAX - 3000000u; /* wraps soon, so that every use of it is tried */
}

void simulation_power_cycle(void)
{
    memset(simulation.effort, 0, sizeof simulation.effort);
    simulation.brake_released = false;
    simulation.stop_latched = simulation.stop_pressed;
    simulation.line_left = 0;
    sampled_us = simulation.time_us;
    simulation.power_ups++;
    board_power_up();
}

void simulation_press_stop(bool pressed)
{
    simulation.stop_pressed = pressed;
    simulation.stop_latched = simulation.stop_latched || pressed;
}

static void sample(void)
{
    board_sample();
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const double effort_nm =
            simulation.stop_pressed ? 0.0 : EFFORT_PER_COUNT_NM * simulation.effort[axis];
        plant_advance(&simulation.plants[axis], effort_nm, SAMPLE_PERIOD_NS * 1e-9);
    }
}

static void call(void (*hook)(void))
{
    if (hook != NULL) {
        hook();
    }
}

bool simulation_pass(uint32_t us)
{
    simulation.time_us += us;
    for (; simulation.time_us - sampled_us >= SAMPLE_US; sampled_us += SAMPLE_US) {
        sample();
    }
    call(simulation.before_poll);
    const bool more = board_poll();
    call(simulation.after_poll);
    return more;
}

void simulation_samples(uint32_t count)
{
    for (; count > 0; count--) {
        simulation_pass(SAMPLE_US);
    }
}

size_t simulation_exchange(const uint8_t *bytes, size_t length)
{
    simulation.line = bytes;
    simulation.line_left = length;
    simulation.reply_length = 0;
    while (simulation.line_left > 0) {
        simulation_pass(100u);
    }
    simulation_pass(LINE_GAP_US); /* ends a frame whose length nothing told */
    simulation_pass(LINE_GAP_US);
    return simulation.reply_length;
}

/* ---- the port */

const struct board_settings *port_settings(void)
{
    return &simulation.settings;
}

uint32_t port_time_us(void)
{
    return simulation.time_us;
}

uint32_t port_random(void)
{
    return ++simulation.random;
}

void port_lock(void)
{
}

void port_unlock(void)
{
}

void port_read_encoders(int32_t counts[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const double turns = simulation.plants[axis].position_rad / 6.283185307179586;
        /* as a counter of 32 bits would, in its own arithmetic */
        const uint32_t sum = (uint32_t)llrint(fmod(turns * COUNTS_PER_TURN, 4294967296.0))
            + (uint32_t)simulation.encoder_offset[axis];
        memcpy(&counts[axis], &sum, sizeof sum);
    }
}

void port_write_effort(const int16_t counts[FD_AXES])
{
    memcpy(simulation.effort, counts, sizeof simulation.effort);
    call(simulation.on_effort);
}

void port_release_brake(bool released)
{
    simulation.brake_released = released;
}

bool port_sto_active(void)
{
    return simulation.stop_pressed;
}

bool port_sto_latched(void)
{
    return simulation.stop_latched;
}

void port_sto_rearm(void)
{
    simulation.stop_latched = simulation.stop_pressed;
}

uint16_t port_homed(void)
{
    return simulation.homed;
}

uint16_t port_limit_switches(void)
{
    return simulation.limit_switches;
}

size_t port_uart_receive(uint8_t *bytes, size_t capacity)
{
    const size_t count = simulation.line_left < capacity ? simulation.line_left : capacity;
    if (count > 0) {
        memcpy(bytes, simulation.line, count);
        simulation.line += count;
        simulation.line_left -= count;
    }
    return count;
}

void port_uart_send(const uint8_t *bytes, size_t length)
{
    memcpy(simulation.reply, bytes, length);
    simulation.reply_length = length;
    simulation.replies++;
}

bool port_store_read(unsigned slot, void *data, size_t size)
{
    memcpy(data, simulation.memory[slot], size);
    return true;
}

bool port_store_write(unsigned slot, const void *data, size_t size)
{
    memcpy(simulation.memory[slot], data, size);
    simulation.memory_writes++;
    return !simulation.memory_fails;
}
