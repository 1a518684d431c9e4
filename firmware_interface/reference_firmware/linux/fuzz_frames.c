/* Random bytes for the frame decoder: noise, frames with a right CRC and random contents, and true
 * requests with flipped bits, with and without silence between them, while samples go on. Every
 * reply must be a frame, and in FAULT there must be no effort. Usage: fuzz_frames ROUNDS SEED */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../board.h"
#include "../crc.h"
#include "../machine.h"
#include "../port.h"

#define GAP_US 1750u

static struct board_settings settings = {
    .counts_per_turn = 8400u,
    .effort_per_count_nm = 0.004f,
    .frame_gap_us = GAP_US,
    .turnaround_us = GAP_US,
    .confirm_window_us = 2000000u,
};
static uint64_t state;
static uint32_t time_us;
static uint8_t incoming[1024];
static size_t arrived, taken;
static unsigned long replies, exceptions, efforts, faults;
static unsigned char memory[STORE_SLOTS][512];

/* xorshift64* */
static uint32_t next_random(void)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (uint32_t)((state * 0x2545f4914f6cdd1dull) >> 32);
}

static uint32_t below(uint32_t limit)
{
    return next_random() % limit;
}

/* ---- the port */

const struct board_settings *port_settings(void)
{
    return &settings;
}

uint32_t port_time_us(void)
{
    return time_us;
}

uint32_t port_random(void)
{
    return next_random();
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
        counts[axis] = (int32_t)below(3);
    }
}

void port_write_effort(const int16_t counts[FD_AXES])
{
    const bool effort = counts[0] != 0 || counts[1] != 0;
    if (effort && (machine.state == FD_STATE_FAULT || machine.state == FD_STATE_INIT)) {
        fprintf(stderr, "effort in state %d\n", (int)machine.state);
        abort();
    }
    efforts += effort;
    faults += machine.state == FD_STATE_FAULT;
}

static bool stop_latched;

void port_release_brake(bool released)
{
    (void)released;
}

bool port_sto_active(void)
{
    const bool active = below(5000) == 0;
    stop_latched = stop_latched || active;
    return active;
}

bool port_sto_latched(void)
{
    return stop_latched;
}

void port_sto_rearm(void)
{
    stop_latched = false;
}

uint16_t port_homed(void)
{
    return 0;
}

uint16_t port_limit_switches(void)
{
    return 0;
}

size_t port_uart_receive(uint8_t *bytes, size_t capacity)
{
    size_t count = arrived - taken;
    count = count < capacity ? count : capacity;
    memcpy(bytes, &incoming[taken], count);
    taken += count;
    return count;
}

void port_uart_send(const uint8_t *bytes, size_t length)
{
    if (length < 5 || length > 256 || bytes[0] != 1
        || crc16(bytes, length - 2) != (bytes[length - 2] | bytes[length - 1] << 8)) {
        fprintf(stderr, "no frame: %zu bytes from %02x\n", length, bytes[0]);
        abort();
    }
    replies++;
    exceptions += (bytes[1] & 0x80u) != 0;
}

bool port_store_read(unsigned slot, void *data, size_t size)
{
    memcpy(data, memory[slot], size);
    return true;
}

bool port_store_write(unsigned slot, const void *data, size_t size)
{
    memcpy(memory[slot], data, size);
    return below(10) != 0;
}

/* ---- what comes over the line */

static size_t with_crc(uint8_t *frame, size_t length)
{
    const uint16_t crc = crc16(frame, length);
    frame[length] = (uint8_t)crc;
    frame[length + 1] = (uint8_t)(crc >> 8);
    return length + 2;
}

static size_t noise(uint8_t *frame)
{
    const size_t length = 1 + below(400);
    for (size_t n = 0; n < length; n++) {
        frame[n] = (uint8_t)next_random();
    }
    return length;
}

/* A request near a register, mostly of a function that the board knows. */
static size_t request(uint8_t *frame)
{
    static const uint8_t functions[] = {3, 3, 6, 16, 16, 16, 1, 23, 43};
    static const uint16_t places[] = {0x0000, 0x0040, 0x0080, 0x0080, 0x0090, 0x00a0, 0x0100,
                                      0x0110, 0x0200, 0x0300, 0x0380, 0x1000, 0x8f80, 0xfff0};
    const uint32_t address = places[below(14)] + (below(2) ? below(130) : 0u);
    const uint32_t count = below(4) ? 1 + below(8) : below(300);
    frame[0] = 1;
    frame[1] = functions[below(9)];
    frame[2] = (uint8_t)(address >> 8);
    frame[3] = (uint8_t)address;
    frame[4] = (uint8_t)(count >> 8);
    frame[5] = (uint8_t)count;
    if (frame[1] != 16) {
        return with_crc(frame, 6);
    }
    frame[6] = (uint8_t)(below(20) ? 2 * count : below(256));
    for (size_t n = 0; n < frame[6]; n++) {
        frame[7 + n] = (uint8_t)(below(3) ? below(10) : next_random());
    }
    return with_crc(frame, 7u + frame[6]);
}

static void let_pass(uint32_t us)
{
    time_us += us;
    board_poll();
    if (below(4) == 0) {
        board_sample();
    }
}

static void one_round(void)
{
    arrived = below(8) ? request(incoming) : noise(incoming);
    taken = 0;
    if (below(6) == 0) {
        incoming[below((uint32_t)arrived)] ^= (uint8_t)(1u << below(8));
    }
    if (below(10) == 0) {
        arrived = below((uint32_t)arrived) + 1u;
    }
    while (taken < arrived) {
        let_pass(below(40) ? 100u : GAP_US);
    }
    for (uint32_t n = below(5) ? 2 : 0; n > 0; n--) {
        let_pass(GAP_US);
    }
}

int main(int count, char **words)
{
    const unsigned long rounds = count == 3 ? strtoul(words[1], NULL, 10) : 0;
    if (rounds == 0) {
        fprintf(stderr, "usage: %s ROUNDS SEED\n", words[0]);
        return 2;
    }
    state = strtoul(words[2], NULL, 10) * 0x9e3779b97f4a7c15ull + 1u;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        settings.axis[axis].travel_rad = 10.0f;
        settings.axis[axis].speed_rad_s = 4.0f;
        settings.axis[axis].effort_nm = 12.0f;
        settings.axis[axis].acceleration_rad_s2 = 60.0f;
        settings.axis[axis].gain_step = 0.6f;
        settings.axis[axis].gain_maximum = settings.axis[axis].first_gains;
        settings.axis[axis].following_error_rad = 1.0f;
        settings.axis[axis].first_gains.offset_feedforward = 1.0f;
        settings.axis[axis].first_gains.coulomb_smoothing = 1.0f;
        settings.axis[axis].first_gains.stribeck_speed = 1.0f;
    }
    board_power_up();
    for (unsigned long n = 0; n < rounds; n++) {
        one_round();
    }
    printf("%lu rounds, %lu replies, %lu of them exceptions, ", rounds, replies, exceptions);
    printf("%lu samples with effort, %lu in fault\n", efforts, faults);
    return EXIT_SUCCESS;
}
