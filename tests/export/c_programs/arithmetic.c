/* The arithmetic of a network in C, one case at a time: a record from stdin, its results to stdout. */
#include <stdio.h>

#include "network.h"

#include SOURCE

int main(void)
{
    struct {
        int32_t sum;
        uint32_t mantissa, shift;
        int32_t zero_point;
        float a, b, c;
    } given;
    while (fread(&given, sizeof given, 1, stdin) == 1) {
        const struct {
            int32_t requantized, quantized;
            float multiply_add, sigmoid;
        } found = {
            requantized(given.sum, given.mantissa, given.shift, given.zero_point),
            quantized(given.a, given.b, given.zero_point),
            multiply_add(given.a, given.b, given.c),
            sigmoid(given.c),
        };
        fwrite(&found, sizeof found, 1, stdout);
    }
    return 0;
}
