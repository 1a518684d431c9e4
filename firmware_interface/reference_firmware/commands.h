/* Commands of the host. [main] */
#ifndef COMMANDS_H
#define COMMANDS_H

#include <stdint.h>

#include "../registers.h"

/* Carry out or refuse a command; a token seen before is ignored. Without the lock. */
void commands_execute(uint16_t opcode, uint16_t token, uint32_t argument);

uint16_t commands_last_token(void);
enum fd_result commands_last_result(void);

#endif
