/* Commands of the host. [main] */
#ifndef COMMANDS_H
#define COMMANDS_H

#include <stdbool.h>
#include <stdint.h>

#include "../registers.h"

/* No command seen yet. */
void commands_init(void);

/* A command as it stands in the registers. */
struct command {
    uint16_t opcode;
    uint16_t token;
    uint32_t argument;
    uint32_t key;
};

/* Carry out or refuse a command; a token seen before is ignored. Without the lock. */
void commands_execute(const struct command *command);

/* Go on with one that takes its time; true while there is more to do. Without the lock. */
bool commands_go_on(void);

uint16_t commands_last_token(void);
enum fd_result commands_last_result(void);

#endif
