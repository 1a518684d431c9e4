#define _DEFAULT_SOURCE
#define _XOPEN_SOURCE 700

#include "port_linux.h"

#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "../port.h"
#include "default_settings.h"
#include "plant.h"

#define SLOT_BYTES 512
#define LARGEST_BACKLOG 100.0 /* samples: where the host is busy, board time falls behind */
#define NAP_NS 500000
#define CONTROL_DELAY_S 0.0005
#define SAMPLE_S (SAMPLE_PERIOD_NS * 1e-9)
/* the clock wraps around soon after power-up, so that every use of it is tried */
#define CLOCK_AT_START_US (UINT32_MAX - 3000000u)

static struct board_settings settings = {
    .serial_number = 2u,
    .control_delay_ns = 500000u,
    .counts_per_turn = COUNTS_PER_TURN,
    .effort_per_count_nm = (float)EFFORT_PER_COUNT_NM,
    /* no line is shared here, and the scheduler makes pauses that a line does not know */
    .frame_gap_us = 50000u,
    .turnaround_us = 0u,
    .confirm_window_us = 120000000u,
};

/* rigid-body sums of the virtual board's drive: docs/virtual_board.md */
static struct plant plants[FD_AXES] = {
    {0.42957, 0.90029, 1.40046, 0.03000, 0.0, 0.0},
    {0.37860, 0.74970, 1.10046, 0.09992, 0.0, 0.0},
};
static double effort_nm[FD_AXES], effort_before_nm[FD_AXES];
static const char *store_path;
static unsigned char store_memory[STORE_SLOTS][SLOT_BYTES];
static double speed;
static double switches_rad;
static uint16_t homed;
static uint64_t start_us;
static int line = -1;
/* the emergency stop's wire, and the latch behind it that hardware would be */
static int stop_pressed, stop_latched;

/* the interrupt; what follows is shared with it, under the lock */
static pthread_t interrupt;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static void (*on_sample)(void);
static bool ended;

static uint64_t now_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

/* ---- for main */

const char *port_linux_open(const struct linux_options *options)
{
    struct termios raw;
    int host_side;
    speed = options->speed;
    store_path = options->store;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        settings.axis[axis] = default_axis;
    }
    homed = (uint16_t)options->homed;
    switches_rad = options->switches_rad;
    settings.confirm_window_us = (uint32_t)(1e6 * options->confirm_window_s);
    start_us = now_us();
    line = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (line < 0 || grantpt(line) != 0 || unlockpt(line) != 0) {
        return NULL;
    }
    /* held open for ever: keeps the line up between hosts */
    host_side = open(ptsname(line), O_RDWR | O_NOCTTY);
    if (host_side < 0 || tcgetattr(host_side, &raw) != 0) {
        return NULL;
    }
    cfmakeraw(&raw);
    return tcsetattr(host_side, TCSANOW, &raw) == 0 ? ptsname(line) : NULL;
}

static void advance_plants(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        plant_advance(&plants[axis], effort_before_nm[axis], CONTROL_DELAY_S);
        plant_advance(&plants[axis], effort_nm[axis], SAMPLE_S - CONTROL_DELAY_S);
        effort_before_nm[axis] = effort_nm[axis];
    }
}

/* Runs the samples that are due. */
static void *interrupt_loop(void *unused)
{
    const struct timespec nap = {.tv_nsec = NAP_NS};
    uint64_t last_us = now_us();
    double due = 0.0;
    for (bool running = true; running;) {
        nanosleep(&nap, NULL);
        const uint64_t present_us = now_us();
        due += (double)(present_us - last_us) * 1e-6 * speed / SAMPLE_S;
        last_us = present_us;
        for (due = fmin(due, LARGEST_BACKLOG); due >= 1.0; due -= 1.0) {
            port_lock();
            on_sample();
            advance_plants();
            port_unlock();
        }
        port_lock();
        running = !ended;
        port_unlock();
    }
    return unused;
}

bool port_linux_start(void (*sample)(void))
{
    sigset_t all, before;
    on_sample = sample;
    /* signals go to the main thread alone: two threads would take a press and its release at once */
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    const int failed = pthread_create(&interrupt, NULL, interrupt_loop, NULL);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return failed == 0;
}

void port_linux_end(void)
{
    port_lock();
    ended = true;
    port_unlock();
    pthread_join(interrupt, NULL);
}

void port_linux_wait(void)
{
    struct pollfd wait = {.fd = line, .events = POLLIN};
    poll(&wait, 1, 1);
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

const struct board_settings *port_settings(void)
{
    return &settings;
}

uint32_t port_time_us(void)
{
    return (uint32_t)(now_us() - start_us + CLOCK_AT_START_US);
}

uint32_t port_random(void)
{
    uint32_t number = 0;
    const int source = open("/dev/urandom", O_RDONLY);
    if (source < 0 || read(source, &number, sizeof number) != (ssize_t)sizeof number) {
        perror("/dev/urandom");
        exit(EXIT_FAILURE);
    }
    close(source);
    return number;
}

void port_lock(void)
{
    pthread_mutex_lock(&lock);
}

void port_unlock(void)
{
    pthread_mutex_unlock(&lock);
}

void port_read_encoders(int32_t counts[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const double turn = plants[axis].position_rad / 6.283185307179586;
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
        pressed |= (plants[axis].position_rad <= -switches_rad ? 1u : 0u) << 2u * axis;
        pressed |= (plants[axis].position_rad >= switches_rad ? 2u : 0u) << 2u * axis;
    }
    return (uint16_t)pressed;
}

size_t port_uart_receive(uint8_t *bytes, size_t capacity)
{
    const ssize_t count = read(line, bytes, capacity);
    return count > 0 ? (size_t)count : 0;
}

void port_uart_send(const uint8_t *bytes, size_t length)
{
    if (write(line, bytes, length) < 0) {
        return; /* nobody reads: the bytes are lost, as on a real line */
    }
}

bool port_store_read(unsigned slot, void *data, size_t size)
{
    if (store_path == NULL) {
        memcpy(data, store_memory[slot], size);
        return true;
    }
    const int file = open(store_path, O_RDONLY);
    const ssize_t count = file < 0 ? -1 : pread(file, data, size, (off_t)slot * SLOT_BYTES);
    if (file >= 0) {
        close(file);
    }
    return count == (ssize_t)size;
}

bool port_store_write(unsigned slot, const void *data, size_t size)
{
    if (store_path == NULL) {
        memcpy(store_memory[slot], data, size);
        return true;
    }
    const int file = open(store_path, O_WRONLY | O_CREAT, 0644);
    const ssize_t count = file < 0 ? -1 : pwrite(file, data, size, (off_t)slot * SLOT_BYTES);
    return file >= 0 && close(file) == 0 && count == (ssize_t)size;
}
