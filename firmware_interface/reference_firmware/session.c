#include "session.h"

#include "../registers.h"
#include "port.h"

#define LEASE_US ((uint32_t)(FD_SESSION_LEASE_S * 1e6f))

#define STOPPED_REMEMBERED 8u

static uint32_t holder;
static uint32_t last_holder; /* also once the hold has run out, but not once it let go */
static uint32_t stopped[STOPPED_REMEMBERED]; /* 0 is no host's key */
static uint32_t stops;
static uint32_t released; /* the key that let go last, until somebody claims */
static uint32_t renewed_us; /* the lease runs from here */
static uint32_t fed_us; /* the watchdog runs from here */

void session_init(void)
{
    holder = last_holder = released = 0;
    for (uint32_t n = 0; n < STOPPED_REMEMBERED; n++) {
        stopped[n] = 0;
    }
    renewed_us = fed_us = port_time_us();
}

void session_sample(bool guarded)
{
    if (session_remaining_us() == 0) {
        holder = 0; /* for good: the clock comes around */
    } else if (guarded) {
        renewed_us = port_time_us();
    }
}

bool session_open_to(uint32_t key, bool heartbeat)
{
    if (heartbeat && key == released) {
        return false;
    }
    for (uint32_t n = 0; n < STOPPED_REMEMBERED; n++) {
        if (stopped[n] == key) {
            return false;
        }
    }
    return holder == 0 || holder == key || session_remaining_us() == 0;
}

void session_claim(uint32_t key)
{
    holder = last_holder = key;
    released = 0;
    renewed_us = fed_us = port_time_us();
}

void session_release(uint32_t key)
{
    if (holder == key) {
        holder = last_holder = 0;
        released = key;
    }
}

void session_stop(uint32_t key)
{
    if (last_holder != 0 && last_holder != key) {
        stopped[stops++ % STOPPED_REMEMBERED] = last_holder;
        holder = last_holder = 0;
    }
}

bool session_held_by(uint32_t key)
{
    return key != 0 && session_key() == key;
}

uint32_t session_key(void)
{
    return session_remaining_us() > 0 ? holder : 0;
}

uint32_t session_remaining_us(void)
{
    const uint32_t passed_us = port_time_us() - renewed_us;
    return holder != 0 && passed_us < LEASE_US ? LEASE_US - passed_us : 0;
}

uint32_t session_silence_us(void)
{
    return port_time_us() - fed_us;
}
