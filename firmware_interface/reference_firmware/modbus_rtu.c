#include "modbus_rtu.h"

#include <stdbool.h>
#include <string.h>

#include "crc.h"
#include "host_requests.h"
#include "port.h"

#define FRAME_LIMIT 256u
#define READ_LIMIT 125u
#define WRITE_LIMIT 123u
#define CRC_BYTES 2u

enum function {
    READ_HOLDING_REGISTERS = 3,
    WRITE_REGISTER = 6,
    WRITE_REGISTERS = 16,
};

enum exception {
    NO_EXCEPTION = 0,
    ILLEGAL_FUNCTION = 1,
    ILLEGAL_ADDRESS = 2,
    ILLEGAL_VALUE = 3,
    DEVICE_BUSY = 6,
};

static uint8_t request[FRAME_LIMIT];
static size_t received;
static uint8_t reply[FRAME_LIMIT];
static size_t to_send;
static uint32_t last_byte_us;
static bool deaf; /* until the next silence: what comes is too long or for another device */

static uint16_t word_at(const uint8_t *bytes)
{
    return (uint16_t)((unsigned)bytes[0] << 8 | bytes[1]);
}

static void put_word(uint8_t *bytes, uint16_t word)
{
    bytes[0] = (uint8_t)(word >> 8);
    bytes[1] = (uint8_t)word;
}

/* ---- functions: each puts its reply behind device and function code, and gives its length */

static enum exception of_access(enum access result)
{
    static const enum exception exceptions[] = {
        [ACCESS_DONE] = NO_EXCEPTION,
        [ACCESS_NO_REGISTER] = ILLEGAL_ADDRESS,
        [ACCESS_BAD_VALUE] = ILLEGAL_VALUE,
        [ACCESS_BUSY] = DEVICE_BUSY,
    };
    return exceptions[result];
}

static enum exception read_registers(size_t *length)
{
    uint16_t words[READ_LIMIT];
    const uint16_t address = word_at(&request[2]), count = word_at(&request[4]);
    if (count == 0 || count > READ_LIMIT) {
        return ILLEGAL_VALUE;
    }
    const enum exception exception = of_access(host_read(address, count, words));
    if (exception == NO_EXCEPTION) {
        reply[2] = (uint8_t)(2u * count);
        for (uint16_t n = 0; n < count; n++) {
            put_word(&reply[3u + 2u * n], words[n]);
        }
        *length = 3u + 2u * count;
    }
    return exception;
}

static enum exception write_register(size_t *length)
{
    const uint16_t word = word_at(&request[4]);
    memcpy(&reply[2], &request[2], 4u);
    *length = 6u;
    return of_access(host_write(word_at(&request[2]), 1u, &word));
}

static enum exception write_registers(size_t *length)
{
    uint16_t words[WRITE_LIMIT];
    const uint16_t address = word_at(&request[2]), count = word_at(&request[4]);
    if (count == 0 || count > WRITE_LIMIT || request[6] != 2u * count) {
        return ILLEGAL_VALUE;
    }
    for (uint16_t n = 0; n < count; n++) {
        words[n] = word_at(&request[7u + 2u * n]);
    }
    memcpy(&reply[2], &request[2], 4u);
    *length = 6u;
    return of_access(host_write(address, count, words));
}

/* ---- frames */

/* Whether what was received so far is a frame. */
static bool valid(void)
{
    const uint16_t found = crc16(request, received - CRC_BYTES);
    return request[received - 2u] == (uint8_t)found && request[received - 1u] == found >> 8;
}

/* Whether the function is one of those that are carried out: then it tells the length, too. */
static bool function_known(void)
{
    return request[1] == READ_HOLDING_REGISTERS || request[1] == WRITE_REGISTER
        || request[1] == WRITE_REGISTERS;
}

/* Length of the request that is coming in; 0 while it cannot be known. */
static size_t expected(void)
{
    if (received < 7u || !function_known()) {
        return 0;
    }
    return request[1] == WRITE_REGISTERS ? 7u + request[6] + CRC_BYTES : 8u;
}

/* Carry out a request of the right length. */
static enum exception carry_out(void)
{
    if (request[1] == READ_HOLDING_REGISTERS) {
        return read_registers(&to_send);
    }
    return request[1] == WRITE_REGISTER ? write_register(&to_send) : write_registers(&to_send);
}

/* Answer the frame that was received: by its length a request, or with an exception at once. */
static void answer(enum exception exception)
{
    reply[0] = MODBUS_DEVICE;
    reply[1] = request[1];
    if (exception == NO_EXCEPTION) {
        exception = carry_out();
    }
    if (exception != NO_EXCEPTION) {
        reply[1] |= 0x80u;
        reply[2] = (uint8_t)exception;
        to_send = 3u;
    }
    const uint16_t crc = crc16(reply, to_send);
    reply[to_send++] = (uint8_t)crc;
    reply[to_send++] = (uint8_t)(crc >> 8);
    received = 0;
}

static void take(uint8_t byte)
{
    deaf = deaf || received == FRAME_LIMIT;
    if (deaf) {
        return;
    }
    request[received++] = byte;
    if (request[0] != MODBUS_DEVICE) {
        deaf = true;
    } else if (received == expected() && valid()) {
        answer(NO_EXCEPTION);
    }
}

/* A silence ends a frame. One that is whole by its CRC, and not by what its function asks for, is
 * answered with an exception; whatever else there is was cut short or broken. */
static void end_frame(void)
{
    if (!deaf && received > CRC_BYTES + 1u && valid()) {
        answer(function_known() ? ILLEGAL_VALUE : ILLEGAL_FUNCTION);
    }
    received = 0;
    deaf = false;
}

void modbus_rtu_init(void)
{
    received = to_send = 0;
    deaf = false;
    last_byte_us = port_time_us();
}

bool modbus_rtu_poll(void)
{
    uint8_t bytes[64];
    const size_t count = port_uart_receive(bytes, sizeof bytes);
    const uint32_t now_us = port_time_us(), silence_us = now_us - last_byte_us;
    if ((received > 0 || deaf) && silence_us >= port_settings()->frame_gap_us) {
        end_frame();
    }
    /* nothing arrived since the request, however much that was: the answer may leave */
    if (to_send > 0 && count == 0 && silence_us >= port_settings()->turnaround_us) {
        port_uart_send(reply, to_send);
        to_send = 0;
    }
    for (size_t n = 0; n < count && to_send == 0; n++) {
        take(bytes[n]);
    }
    if (count > 0) {
        last_byte_us = now_us;
    }
    return to_send > 0;
}
