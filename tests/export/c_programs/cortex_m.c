/* Runs a network on a Cortex-M in QEMU, without a library. Prints for each image its answer as bits,
 * then the instructions and the stack that one call took.
 *
 * network.h, which the test writes, names it: RUN, MEMORY, IMAGES and the images.
 */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "network.h"

#define STACK_BYTES 8192u
#include "bare_metal.h"

static MEMORY memory;

static uint32_t bits(float value)
{
    union {
        float value;
        uint32_t bits;
    } number = {value};
    return number.bits;
}

__attribute__((noinline)) static void run(size_t image)
{
    float answer[2][4];
    const uint32_t begin = TICK;
    const bool valid = RUN(images[image], &memory, answer[0], answer[1]);
    const uint32_t end = TICK;
    for (size_t i = 0; i < 8; i++) {
        print(valid ? "answer " : "invalid ", bits(answer[i / 4][i % 4]));
    }
    print("instructions ", ((begin - end) & TICKS) * NANOSECONDS_PER_TICK);
}

static void program(void)
{
    for (size_t image = 0; image < IMAGES; image++) {
        run(image);
    }
}
