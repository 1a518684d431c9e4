#include "linux_drive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../port.h"
#include "default_settings.h"
#include "plant_socket.h"

#define CONTROL_DELAY_S 0.0005
#define SAMPLE_S (SAMPLE_PERIOD_NS * 1e-9)

const uint32_t linux_drive_serial_number = 2u;

static struct plant plants[FD_AXES]; /* unless the plant is another process's */
static bool remote;
static double shown_rad[FD_AXES]; /* by the encoders */
static double effort_nm[FD_AXES], effort_before_nm[FD_AXES];
static double switches_rad;
static uint16_t homed;
/* the emergency stop's wire, and the latch behind it that hardware would be */
static int stop_pressed, stop_latched;

void linux_drive_open(const struct linux_options *options)
{
    memcpy(plants, default_plants, sizeof plants);
    homed = (uint16_t)options->homed;
    switches_rad = options->switches_rad;
    remote = options->plant != NULL;
    if (remote && !plant_socket_open(options->plant, CONTROL_DELAY_S, shown_rad)) {
        exit(EXIT_FAILURE);
    }
}

static void advance_plants(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        plant_advance(&plants[axis], effort_before_nm[axis], CONTROL_DELAY_S);
        plant_advance(&plants[axis], effort_nm[axis], SAMPLE_S - CONTROL_DELAY_S);
        effort_before_nm[axis] = effort_nm[axis];
        shown_rad[axis] = plants[axis].position_rad;
    }
}

void linux_drive_sample(void (*on_sample)(void))
{
    port_lock();
    on_sample();
    if (!remote) {
        advance_plants();
    } else if (!plant_socket_advance(effort_nm, shown_rad)) {
        exit(EXIT_FAILURE); /* there is nothing left to control */
    }
    port_unlock();
}

/* Interrupts the main loop wherever that is: no lock here. */
void port_linux_press_stop(bool pressed)
{
    if (pressed) {
        __atomic_store_n(&stop_latched, 1, __ATOMIC_SEQ_CST);
    }
    __atomic_store_n(&stop_pressed, pressed, __ATOMIC_SEQ_CST);
}

/* ---- the port */

void port_read_encoders(int32_t counts[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const double turn = shown_rad[axis] / 6.283185307179586;
        counts[axis] = (int32_t)lrint(turn * COUNTS_PER_TURN);
    }
}

void port_write_effort(const int16_t counts[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        effort_nm[axis] = port_sto_active() ? 0.0 : EFFORT_PER_COUNT_NM * counts[axis];
    }
}

/* Nothing here needs holding: the plant's friction does. */
void port_release_brake(bool released)
{
    (void)released;
}

bool port_sto_active(void)
{
    return __atomic_load_n(&stop_pressed, __ATOMIC_SEQ_CST) != 0;
}

bool port_sto_latched(void)
{
    return __atomic_load_n(&stop_latched, __ATOMIC_SEQ_CST) != 0;
}

void port_sto_rearm(void)
{
    __atomic_store_n(&stop_latched, 0, __ATOMIC_SEQ_CST);
    if (port_sto_active()) { /* pressed just now, perhaps before its latch was taken back */
        __atomic_store_n(&stop_latched, 1, __ATOMIC_SEQ_CST);
    }
}

uint16_t port_homed(void)
{
    return homed;
}

uint16_t port_limit_switches(void)
{
    unsigned pressed = 0;
    for (unsigned axis = 0; axis < FD_AXES && switches_rad > 0.0; axis++) {
        pressed |= (shown_rad[axis] <= -switches_rad ? 1u : 0u) << 2u * axis;
        pressed |= (shown_rad[axis] >= switches_rad ? 2u : 0u) << 2u * axis;
    }
    return (uint16_t)pressed;
}
