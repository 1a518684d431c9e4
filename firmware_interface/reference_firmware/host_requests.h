/* What a host may ask of the registers: those of the map, the pages behind them, and the rules that
 * say when a write is taken. Modbus RTU serves it; another protocol would as well. [main]
 * Without the lock. */
#ifndef HOST_REQUESTS_H
#define HOST_REQUESTS_H

#include <stdint.h>

#include "register_file.h"

/* Words of consecutive registers, all of one moment. */
enum access host_read(uint16_t address, uint16_t count, uint16_t *words);

/* All of them or none; what they ask for is carried out. */
enum access host_write(uint16_t address, uint16_t count, const uint16_t *words);

#endif
