/* Reads images from stdin and writes the network's answers, residuals and sigmoids, to stdout. */
#include <stdio.h>

#include "network.h"

static float image[PIXELS];
static MEMORY memory;

int main(void)
{
    if (sizeof memory != MEMORY_BYTES) {
        return 2;
    }
    while (fread(image, sizeof image, 1, stdin) == 1) {
        float answer[2][4];
        if (!RUN(image, &memory, answer[0], answer[1])) {
            return 1;
        }
        fwrite(answer, sizeof answer, 1, stdout);
    }
    return 0;
}
