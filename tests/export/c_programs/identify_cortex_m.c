/* Runs the firmware's identification on a Cortex-M in QEMU, of the counts in capture.h. Prints the
 * registers of the identification, then the instructions of the whole, the most of them between two
 * pauses, and the stack. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "capture.h"
#include "host_requests.h"
#include "identification.h"
#include "port.h"
#include "register_file.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define STACK_TOP 0x20400000u
#define STACK_BYTES 16384u
#define PATTERN 0xa5a5a5a5u
#define NANOSECONDS_PER_TICK 40u /* of the boards' 25 MHz; -icount shift=0 makes one an instruction */
#define WORDS (FD_REG_IDENTIFICATION_CRC + 2u - FD_REG_IDENTIFICATION_STATE)

static uint32_t last_tick, most_ticks;
static uint64_t ticks;

static uint32_t semihosting(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static void print(const char *name, uint32_t value)
{
    char text[10];
    for (size_t i = 0; i < 8; i++) {
        text[i] = "0123456789abcdef"[value >> (28u - 4u * i) & 15u];
    }
    text[8] = '\n';
    text[9] = '\0';
    semihosting(4, name);
    semihosting(4, text);
}

static void pause(void)
{
    const uint32_t now = REGISTER(0xe000e018);
    const uint32_t passed = (last_tick - now) & 0xffffffu;
    ticks += passed;
    most_ticks = passed > most_ticks ? passed : most_ticks;
    last_tick = REGISTER(0xe000e018);
}

/* ---- the port */

const struct board_settings *port_settings(void)
{
    static const struct board_settings settings = {
        .counts_per_turn = COUNTS_PER_TURN,
        .effort_per_count_nm = EFFORT_PER_COUNT_NM,
        .control_delay_ns = CONTROL_DELAY_NS,
    };
    return &settings;
}

void port_lock(void)
{
}

void port_unlock(void)
{
}

/* ---- the program */

static void add_capture(void)
{
    identification_begin(7u, SAMPLES);
    for (size_t n = 0; n < SAMPLES; n++) {
        struct drive_sample sample;
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            sample.position[axis] = captured[n][2u * axis];
            sample.effort[axis] = (int16_t)captured[n][2u * axis + 1u];
        }
        identification_add(&sample);
    }
    identification_captured();
}

static uint32_t stack_used(void)
{
    uint32_t address = STACK_TOP - STACK_BYTES;
    while (REGISTER(address) == PATTERN) {
        address += 4u;
    }
    return STACK_TOP - address;
}

void reset(void);
void reset(void)
{
    REGISTER(0xe000ed88) |= 15u << 20; /* the floating-point unit */
    __asm__ volatile("dsb\nisb");
    REGISTER(0xe000e014) = 0xffffffu; /* SysTick counts down */
    REGISTER(0xe000e018) = 0u;
    REGISTER(0xe000e010) = 5u;
    const uint32_t here = (uint32_t)__builtin_frame_address(0) - 256u;
    for (uint32_t address = STACK_TOP - STACK_BYTES; address < here; address += 4u) {
        REGISTER(address) = PATTERN;
    }
    register_file_init();
    identification_init();
    const uint32_t begin = REGISTER(0xe000e018);
    add_capture();
    print("capture ", ((begin - REGISTER(0xe000e018)) & 0xffffffu) * NANOSECONDS_PER_TICK);
    last_tick = REGISTER(0xe000e018);
    identification_go_on(pause);
    pause();
    identification_publish();
    for (uint32_t n = 0; n < WORDS; n++) {
        print("word ", register_u16((uint16_t)(FD_REG_IDENTIFICATION_STATE + n)));
    }
    print("thousands ", (uint32_t)(ticks * NANOSECONDS_PER_TICK / 1000u));
    print("most ", most_ticks * NANOSECONDS_PER_TICK);
    print("stack ", stack_used());
    semihosting(0x18, (const void *)0x20026);
    for (;;) {
    }
}

static const struct {
    uint32_t stack;
    void (*reset)(void);
} vectors __attribute__((section(".vectors"), used)) = {STACK_TOP, reset};
