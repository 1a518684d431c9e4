/* The port in simulated time, on one thread: what the board is told and what it does are at hand,
 * and the same happens at every run. For the programs that try the firmware out. */
#ifndef SIMULATION_H
#define SIMULATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../port.h"
#include "../linux/plant.h"

#define LINE_GAP_US 1750u
#define SAMPLE_US (SAMPLE_PERIOD_NS / 1000u)
#define MEMORY_BYTES 1024u

struct simulation {
    struct board_settings settings;
    uint32_t time_us;
    uint32_t random; /* what port_random gives */

    struct plant plants[FD_AXES];
    int32_t encoder_offset[FD_AXES]; /* added to the plant's position, and wraps around */
    int16_t effort[FD_AXES]; /* commanded last */
    bool brake_released;

    bool stop_pressed, stop_latched;
    uint16_t homed, limit_switches;

    unsigned char memory[STORE_SLOTS][MEMORY_BYTES];
    unsigned long memory_writes;
    bool memory_fails;

    const uint8_t *line; /* bytes on their way to the board */
    size_t line_left;
    uint8_t reply[256];
    size_t reply_length; /* of the last one; 0 before */
    unsigned long replies;

    unsigned long power_ups;
    uint16_t token; /* of the client's last command */

    /* Called where they are not null. */
    void (*on_effort)(void); /* `effort` was commanded */
    void (*before_poll)(void);
    void (*after_poll)(void);
};

extern struct simulation simulation;

/* A board on a rigid drive, at rest and without memory, not yet powered up. */
void simulation_reset(void);

/* Cut the power and bring it back. */
void simulation_power_cycle(void);

/* The wire of the emergency stop. */
void simulation_press_stop(bool pressed);

/* Let time pass: samples as they fall due, and one call of the main loop at the end; gives what
 * that says. */
bool simulation_pass(uint32_t us);

/* Let so many samples pass, the main loop called at each. */
void simulation_samples(uint32_t count);

/* Put bytes on the line, one frame or any other, and let the time pass that they and an answer to
 * them take; gives the length of the answer in simulation.reply, or 0. */
size_t simulation_exchange(const uint8_t *bytes, size_t length);

#endif
