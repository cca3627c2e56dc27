/* How does firmware for an ATmega328P run with nothing soldered: its UART on a file, its converters on another?
 *
 * Usage: board FIRMWARE.elf UART_FD BENCH_FD SPEED
 *
 * simavr runs the firmware as it would be flashed. Around it are the parts of drivers/firmware/uno: a DAC on the SPI,
 * selected by PB2, the rig between it and the ADC, and a lamp on PB0 that shows the sample clock running. The rig is at
 * the other end of BENCH_FD, in records of four 32-bit numbers:
 *
 *   SAMPLE code, number in the run, period in cycles   answered by one 32-bit number: the code the ADC reads
 *   LEVEL  code                                        the output moved with no reading
 *   END    idle, shortest, longest period in cycles    the lamp went out; idle are thousandths of the run asleep
 *   FAULT  which                                       something no real board would have forgiven
 *   RESET                                              the controller was reset as it was asked
 *
 * SIGUSR1 resets the controller, SIGUSR2 hangs it: it executes nothing any more until something resets it.
 * simavr is under the GPL, version 3; this program is for tests and no part of what is installed.
 */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "avr_adc.h"
#include "avr_ioport.h"
#include "avr_uart.h"
#include "sim_avr.h"
#include "sim_elf.h"
#include "sim_interrupts.h"

enum { FREQUENCY = 16000000, TURN = FREQUENCY / 2000 };
enum { SUPPLY_MV = 5000, ADC_STEPS = 1023, ADC_MIDDLE = 512, DAC_MIDDLE = 2048 };
enum { LAMP = 0, SELECT = 2 };
enum { SAMPLE, LEVEL, END, FAULT, RESET };
enum { OUTPUT_TOO_SOON = 1, BYTE_LOST, WRONG_WORD, CRASHED };
enum { HOLD = 160 };      /* cycles: two and a half clocks of the ADC, until its input is held */
enum { HARDWARE_FIFO = 3 }; /* bytes: two in the UART's buffer, one in its shift register */
enum { OCR1A_LOW = 0x88, OCR1A_HIGH = 0x89, SPI_CONTROL = 0x4C, SPI_STATUS = 0x4D, SPI_DATA = 0x4E };
enum { UART_STATUS = 0xC0, UART_DOUBLE = 0x02, BAUD_LOW = 0xC4, BAUD_HIGH = 0xC5 };
enum { JUMP_TO_ITSELF = 0xCFFF }; /* rjmp .-2 */
enum { SPI_DONE = 0x80, SPI_DOUBLE = 0x01, SPI_RATE = 0x03 };

static avr_t *avr;
static int uart_fd, bench_fd;
static double speed;
static uint8_t inbox[4096], outbox[4096];
static size_t inbox_at, inbox_size, outbox_size;
static avr_irq_t *uart_in, *adc_in;
static avr_uart_t *uart;
static uint16_t word;
static uint8_t bits;
static bool lamp, reading;
static avr_cycle_count_t read_at, shortest, longest, lit_at, asleep;
static uint32_t number;
static volatile sig_atomic_t asked_reset, asked_hang;

static void fail(const char *what)
{
    perror(what);
    exit(1);
}

static void exchange(int32_t kind, int32_t a, int32_t b, int32_t c)
{
    int32_t record[4] = {kind, a, b, c};
    if (write(bench_fd, record, sizeof record) != sizeof record)
        exit(0); /* the test is over */
}

/* Give the ADC the voltage in mV from which simavr makes this code. */
static void present(int32_t code)
{
    uint32_t steps = (uint32_t)(code + ADC_MIDDLE);
    avr_raise_irq(adc_in, (steps * SUPPLY_MV + ADC_STEPS - 1) / ADC_STEPS);
}

static void sample(int32_t code)
{
    int32_t answer;
    int32_t period = 8 * (1 + (avr->data[OCR1A_LOW] | avr->data[OCR1A_HIGH] << 8));
    exchange(SAMPLE, code, (int32_t)number++, period);
    if (read(bench_fd, &answer, sizeof answer) != sizeof answer)
        exit(0);
    present(answer);
}

static void on_output(int32_t code)
{
    if (reading && avr->cycle - read_at < HOLD)
        exchange(FAULT, OUTPUT_TOO_SOON, 0, 0);
    if (reading)
        sample(code);
    else
        exchange(LEVEL, code, 0, 0);
    reading = false;
}

static void on_reading(avr_irq_t *irq, uint32_t value, void *unused)
{
    if (!lamp)
        return;
    avr_cycle_count_t period = avr->cycle - read_at;
    if (number && period < shortest)
        shortest = period;
    if (number && period > longest)
        longest = period;
    read_at = avr->cycle;
    reading = true;
}

static avr_cycle_count_t spi_done(avr_t *unused, avr_cycle_count_t when, void *none)
{
    avr->data[SPI_STATUS] |= SPI_DONE;
    return 0;
}

/* The SPI of simavr 1.6 takes 100 us for a byte, whatever its clock is; this one takes the time the data sheet says. */
static void on_spi(avr_t *unused, avr_io_addr_t address, uint8_t byte, void *none)
{
    static const uint8_t DIVIDERS[] = {4, 16, 64, 128};
    uint8_t divider = DIVIDERS[avr->data[SPI_CONTROL] & SPI_RATE] / (avr->data[SPI_STATUS] & SPI_DOUBLE ? 2 : 1);
    avr->data[SPI_STATUS] &= (uint8_t)~SPI_DONE;
    avr_cycle_timer_register(avr, 8 * divider, spi_done, NULL);
    word = (uint16_t)(word << 8 | byte);
    bits += 8;
}

static void on_select(avr_irq_t *irq, uint32_t high, void *unused)
{
    if (high && bits == 16 && word >> 12 == 3)
        on_output((word & 0xFFF) - DAC_MIDDLE);
    else if (high && bits)
        exchange(FAULT, WRONG_WORD, word, bits);
    bits = 0;
}

static void on_lamp(avr_irq_t *irq, uint32_t high, void *unused)
{
    if (lamp && !high)
        exchange(END, (int32_t)(1000 * asleep / (avr->cycle - lit_at)), (int32_t)shortest, (int32_t)longest);
    lamp = high;
    lit_at = avr->cycle;
    asleep = 0;
    reading = false;
    number = 0;
    shortest = UINT32_MAX;
    longest = 0;
}

static void flush(void)
{
    ssize_t gone = outbox_size ? write(uart_fd, outbox, outbox_size) : 0;
    if (gone < 0 && errno != EAGAIN && errno != EIO)
        fail("UART");
    outbox_size = 0; /* what nobody reads is lost, as on a wire */
}

static void on_sent(avr_irq_t *irq, uint32_t byte, void *unused)
{
    outbox[outbox_size++] = (uint8_t)byte;
    if (outbox_size == sizeof outbox)
        flush();
}

/* Ten bits, and a quarter more: simavr takes eleven for itself, and bytes would pile up. */
static avr_cycle_count_t byte_cycles(void)
{
    uint32_t divider = 1 + (avr->data[BAUD_LOW] | avr->data[BAUD_HIGH] << 8);
    return (avr->data[UART_STATUS] & UART_DOUBLE ? 100 : 200) * divider;
}

/* Deliver the bytes of the host one by one at the speed of the wire. */
static avr_cycle_count_t deliver(avr_t *unused, avr_cycle_count_t when, void *none)
{
    if (inbox_at == inbox_size)
        return 0;
    if ((uart->input.write - uart->input.read) % uart_fifo_fifo_size < HARDWARE_FIFO)
        avr_raise_irq(uart_in, inbox[inbox_at]);
    else
        exchange(FAULT, BYTE_LOST, 0, 0);
    inbox_at++;
    return when + byte_cycles();
}

static void listen(void)
{
    if (inbox_at < inbox_size)
        return;
    ssize_t got = read(uart_fd, inbox, sizeof inbox);
    if (got <= 0)
        return;
    inbox_at = 0;
    inbox_size = (size_t)got;
    avr_cycle_timer_register(avr, byte_cycles(), deliver, NULL);
}

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Keep pace with the clock on the wall; a test that is over has closed the bench. */
static void keep_pace(double *start, avr_cycle_count_t *from)
{
    double ahead = (double)(avr->cycle - *from) / FREQUENCY / speed - (now() - *start);
    if (ahead < -0.01) { /* the computer was busy: do not catch up, the host could not follow */
        *start = now();
        *from = avr->cycle;
    } else if (ahead > 0) {
        struct timespec pause = {0, (long)(1e9 * ahead)};
        nanosleep(&pause, NULL);
    }
    struct pollfd bench = {.fd = bench_fd, .events = 0};
    if (poll(&bench, 1, 0) > 0 && bench.revents & (POLLHUP | POLLERR))
        exit(0);
}

/* Sleep costs no time here: simavr goes on to what wakes the controller. */
static void count_sleep(avr_t *unused, avr_cycle_count_t cycles)
{
    asleep += cycles;
}

static void ask(int which)
{
    if (which == SIGUSR1)
        asked_reset = 1;
    else
        asked_hang = 1;
}

/* Stand still with interrupts off, as firmware does that ran into a bug; the hardware watchdog runs on.
 *
 * The instruction at hand becomes a jump to itself: carried out again and again, a push or a return would move the stack
 * until simavr gives up. */
static void hang(void)
{
    uint8_t *stuck = avr->flash + avr->pc;
    const uint8_t meant[] = {stuck[0], stuck[1]};
    avr_cycle_count_t until = avr->cycle + FREQUENCY;
    stuck[0] = JUMP_TO_ITSELF & 0xFF;
    stuck[1] = JUMP_TO_ITSELF >> 8;
    do {
        avr->sreg[S_I] = 0;
        avr->state = cpu_Running;
        avr_run(avr);
    } while (avr->cycle < until && avr->pc != 0);
    stuck[0] = meant[0];
    stuck[1] = meant[1];
}

static void wire(void)
{
    uint32_t quiet = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &quiet);
    uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    for (avr_io_t *port = avr->io_port; port; port = port->next)
        if (port->irq && uart_in >= port->irq && uart_in < port->irq + port->irq_count)
            uart = (avr_uart_t *)port;
    adc_in = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_sent, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), on_reading, NULL);
    avr->io[AVR_DATA_TO_IO(SPI_DATA)].w.c = on_spi;
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), SELECT), on_select, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), LAMP), on_lamp, NULL);
}

static void power_up(const char *path)
{
    elf_firmware_t firmware = {0};
    if (elf_read_firmware(path, &firmware))
        fail(path);
    avr = avr_make_mcu_by_name("atmega328p");
    if (!avr || avr_init(avr))
        fail("atmega328p");
    firmware.frequency = FREQUENCY;
    avr_load_firmware(avr, &firmware);
    avr->vcc = avr->avcc = avr->aref = SUPPLY_MV;
    avr->log = LOG_ERROR;
    avr->sleep = count_sleep;
    wire();
}

static void live(void)
{
    double start = now();
    avr_cycle_count_t from = avr->cycle, turn = avr->cycle;
    for (int state = cpu_Running; state != cpu_Done && state != cpu_Crashed; state = avr_run(avr)) {
        if (asked_reset) {
            asked_reset = 0;
            avr_reset(avr);
            exchange(RESET, 0, 0, 0);
        } else if (asked_hang) {
            asked_hang = 0;
            hang();
        }
        if (avr->cycle >= turn) {
            turn = avr->cycle + TURN;
            flush();
            listen();
            keep_pace(&start, &from);
        }
    }
    exchange(FAULT, CRASHED, 0, 0);
}

int main(int count, char **words)
{
    if (count != 5) {
        fprintf(stderr, "usage: %s FIRMWARE.elf UART_FD BENCH_FD SPEED\n", words[0]);
        return 2;
    }
    uart_fd = atoi(words[2]);
    bench_fd = atoi(words[3]);
    speed = atof(words[4]);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGUSR1, ask);
    signal(SIGUSR2, ask);
    power_up(words[1]);
    live();
    return 1;
}
