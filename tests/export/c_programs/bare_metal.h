/* What programs need that run on a Cortex-M in QEMU without a library: they print over semihosting,
 * count instructions with SysTick, and measure their stack.
 *
 * A program defines STACK_BYTES before it includes this, and program(). */
#ifndef BARE_METAL_H
#define BARE_METAL_H

#include <stddef.h>
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define TICK REGISTER(0xe000e018) /* SysTick, which counts down */
#define TICKS 0xffffffu
#define STACK_TOP 0x20400000u
#define PATTERN 0xa5a5a5a5u
#define NANOSECONDS_PER_TICK 40u /* of the boards' 25 MHz; -icount shift=0 makes one an instruction */

static void program(void);

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
    REGISTER(0xe000e014) = TICKS;
    TICK = 0u;
    REGISTER(0xe000e010) = 5u;
    const uint32_t here = (uint32_t)__builtin_frame_address(0) - 256u;
    for (uint32_t address = STACK_TOP - STACK_BYTES; address < here; address += 4u) {
        REGISTER(address) = PATTERN;
    }
    program();
    print("stack ", stack_used());
    semihosting(0x18, (const void *)0x20026);
    for (;;) {
    }
}

static const struct {
    uint32_t stack;
    void (*reset)(void);
} vectors __attribute__((section(".vectors"), used)) = {STACK_TOP, reset};

#endif
