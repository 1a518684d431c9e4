/* What a fuzzer gives bytes to: each begins with a board just powered up, and fuzz_invariants.c
 * says what must hold. */
#ifndef FUZZ_TARGETS_H
#define FUZZ_TARGETS_H

#include <stddef.h>
#include <stdint.h>

/* As libFuzzer calls it; the environment's FUZZ_TARGET names the target. */
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t length);

#endif
