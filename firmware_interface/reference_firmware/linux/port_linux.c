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
#include "linux_drive.h"

#define SLOT_BYTES 1024
#define LARGEST_BACKLOG 100.0 /* samples: where the host is busy, board time falls behind */
#define NAP_NS 500000
#define LONGEST_STEP_US 50000u
#define SAMPLE_S (SAMPLE_PERIOD_NS * 1e-9)
/* the clock wraps around soon after power-up, so that every use of it is tried */
#define CLOCK_AT_START_US (UINT32_MAX - 3000000u)

static struct board_settings settings = {
    .control_delay_ns = 500000u,
    .counts_per_turn = COUNTS_PER_TURN,
    .effort_per_count_nm = (float)EFFORT_PER_COUNT_NM,
    /* no line is shared here, and the scheduler makes pauses that a line does not know */
    .frame_gap_us = 50000u,
    .turnaround_us = 0u,
    .confirm_window_us = 120000000u,
};

static const char *store_path;
static unsigned char store_memory[STORE_SLOTS][SLOT_BYTES];
static double speed;
static int line = -1, host_side = -1;

/* A busy computer may not let the main loop run, or the kernel's thread that moves bytes on a
 * pseudo-terminal, for seconds. That is no host which has fallen silent: time waits, and the
 * drive with it. */
static pthread_mutex_t time_lock = PTHREAD_MUTEX_INITIALIZER;
static uint64_t passed_us, seen_us; /* until the main loop was seen last, and when that was */

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

/* Time that has passed on the board; the main loop says that it runs. */
static uint64_t board_us(bool main_loop)
{
    pthread_mutex_lock(&time_lock);
    const uint64_t present_us = now_us(), step_us = present_us - seen_us;
    const uint64_t board = passed_us + (step_us < LONGEST_STEP_US ? step_us : LONGEST_STEP_US);
    if (main_loop) {
        passed_us = board;
        seen_us = present_us;
    }
    pthread_mutex_unlock(&time_lock);
    return board;
}

/* ---- for main */

const char *port_linux_open(const struct linux_options *options)
{
    struct termios raw;
    speed = options->speed;
    store_path = options->store;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        settings.axis[axis] = default_axis;
        settings.axis[axis].inertia = (float)default_plants[axis].inertia;
        settings.axis[axis].viscous_friction = (float)default_plants[axis].viscous_friction;
    }
    settings.serial_number = linux_drive_serial_number;
    settings.confirm_window_us = (uint32_t)(1e6 * options->confirm_window_s);
    linux_drive_open(options);
    seen_us = now_us();
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

/* Runs the samples that are due. */
static void *interrupt_loop(void *unused)
{
    const struct timespec nap = {.tv_nsec = NAP_NS};
    uint64_t last_us = board_us(false);
    double due = 0.0;
    for (bool running = true; running;) {
        nanosleep(&nap, NULL);
        const uint64_t present_us = board_us(false);
        due += (double)(present_us - last_us) * 1e-6 * speed / SAMPLE_S;
        last_us = present_us;
        for (due = fmin(due, LARGEST_BACKLOG); due >= 1.0; due -= 1.0) {
            linux_drive_sample(on_sample);
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

/* ---- the port */

const struct board_settings *port_settings(void)
{
    return &settings;
}

uint32_t port_time_us(void)
{
    return (uint32_t)(board_us(false) + CLOCK_AT_START_US);
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

size_t port_uart_receive(uint8_t *bytes, size_t capacity)
{
    const ssize_t count = read(line, bytes, capacity);
    board_us(true);
    return count > 0 ? (size_t)count : 0;
}

void port_uart_send(const uint8_t *bytes, size_t length)
{
    struct pollfd other_end = {.fd = host_side, .events = POLLIN};
    if (write(line, bytes, length) < 0) {
        return; /* nobody reads: the bytes are lost, as on a real line */
    }
    poll(&other_end, 1, 0); /* waits for the kernel's thread that moves them */
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
