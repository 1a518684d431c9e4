/* What the fuzzer does to the board: bytes, frames, commands, motions, accidents. */
#ifndef FUZZ_PLAYS_H
#define FUZZ_PLAYS_H

/* One of them, by chance; gives the number of frames that it sent. */
unsigned long fuzz_play(void);

#endif
