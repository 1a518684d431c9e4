/* Modbus RTU slave: frames, their timing and CRC, function codes, exceptions. [main]
 *
 * Function codes 3 (read holding registers), 6 (write one) and 16 (write several). A request is
 * answered before the next is listened to: what arrives in between is thrown away. A broadcast
 * (device 0) is ignored, like what is for another device.
 */
#ifndef MODBUS_RTU_H
#define MODBUS_RTU_H

#include <stdbool.h>

#define MODBUS_DEVICE 1u

/* Nothing received yet. */
void modbus_rtu_init(void);

/* Take what the line received; answer a request when it is complete. True while an answer waits. */
bool modbus_rtu_poll(void);

#endif
