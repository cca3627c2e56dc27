#include "board.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/delay.h>

#include "run.h"

#define RECEIVED 128 /* bytes; powers of two, at most 256 */
#define QUEUED 64
#define BAUD_DIVIDER ((F_CPU / 4 / BAUD - 1) / 2)

/* Port B: lamp on D8, and the DAC's chip select, data and clock on D10, D11 and D13. */
#define LAMP PB0
#define SELECT PB2
#define DATA PB3
#define CLOCK PB5

/* The input is held one and a half clocks of the ADC (4 us each) after a conversion began, and that waits for a clock. */
#define HOLD_US 11

/* To an MCP4921 or channel A of an MCP4922: gain 1, switched on. */
#define DAC_WRITE 0x3000
#define DAC_MIDDLE 2048
#define ADC_MIDDLE 512

static volatile uint8_t received[RECEIVED], queued[QUEUED];
static volatile uint8_t received_in, received_out, queued_in, queued_out;
static volatile uint32_t ms;
static volatile bool converting;

/* The hardware watchdog stays on through the reset it causes, at its shortest time: off, before memory is cleared. */
void watchdog_off(void) __attribute__((naked, used, section(".init3")));

void watchdog_off(void)
{
    MCUSR = 0;
    wdt_disable();
}

void board_start(void)
{
    PORTB = _BV(SELECT);
    DDRB = _BV(LAMP) | _BV(SELECT) | _BV(DATA) | _BV(CLOCK);
    SPCR = _BV(SPE) | _BV(MSTR);
    SPSR = _BV(SPI2X);

    UCSR0A = _BV(U2X0);
    UBRR0 = BAUD_DIVIDER;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);

    OCR0A = F_CPU / 64 / 1000 - 1;
    TCCR0A = _BV(WGM01);
    TCCR0B = _BV(CS01) | _BV(CS00);
    TIMSK0 = _BV(OCIE0A);

    DIDR0 = _BV(ADC0D);
    ADMUX = _BV(REFS0);
    ADCSRA = _BV(ADEN) | _BV(ADSC) | _BV(ADPS2) | _BV(ADPS1);
    while (ADCSRA & _BV(ADSC)) {
    } /* the first conversion is a long one: not of a run */
    ADCSRA |= _BV(ADIF);
    ADCSRA |= _BV(ADIE);

    set_sleep_mode(SLEEP_MODE_IDLE);
    wdt_enable(WDTO_250MS);
    sei();
}

bool board_receive(uint8_t *byte)
{
    if (received_in == received_out)
        return false;
    *byte = received[received_out];
    received_out = (received_out + 1) % RECEIVED;
    return true;
}

bool board_room(void)
{
    return (queued_in + 1) % QUEUED != queued_out;
}

void board_send(uint8_t byte)
{
    queued[queued_in] = byte;
    queued_in = (queued_in + 1) % QUEUED;
    uint8_t before = board_lock();
    UCSR0B |= _BV(UDRIE0);
    board_unlock(before);
}

void board_clock_start(uint32_t divider)
{
    TCNT1 = 0;
    OCR1A = (uint16_t)(divider - 1);
    TIFR1 = _BV(OCF1A);
    TIMSK1 = _BV(OCIE1A);
    TCCR1A = 0;
    TCCR1B = _BV(WGM12) | _BV(CS11);
}

void board_clock_stop(void)
{
    TIMSK1 = 0;
    TCCR1B = 0;
    while (converting && (SREG & _BV(SREG_I))) {
    } /* with interrupts off it is an interrupt that stops the clock, and then none is under way */
}

void board_read_input(void)
{
    converting = true;
    ADCSRA |= _BV(ADSC);
    _delay_us(HOLD_US);
}

static void shift_out(uint8_t byte)
{
    SPDR = byte;
    while (!(SPSR & _BV(SPIF))) {
    }
}

void board_write_output(int16_t code)
{
    uint16_t word = DAC_WRITE | (uint16_t)(code + DAC_MIDDLE);
    PORTB &= (uint8_t)~_BV(SELECT);
    shift_out((uint8_t)(word >> 8));
    shift_out((uint8_t)word);
    PORTB |= _BV(SELECT);
}

uint32_t board_ms(void)
{
    uint8_t before = board_lock();
    uint32_t now = ms;
    board_unlock(before);
    return now;
}

void board_lamp(bool on)
{
    if (on)
        PORTB |= _BV(LAMP);
    else
        PORTB &= (uint8_t)~_BV(LAMP);
}

void board_alive(void)
{
    wdt_reset();
}

void board_rest(void)
{
    cli();
    if (received_in == received_out) {
        sleep_enable();
        sei(); /* takes effect after the next instruction: what arrives now still wakes */
        sleep_cpu();
        sleep_disable();
    }
    sei();
}

uint8_t board_lock(void)
{
    uint8_t before = SREG;
    cli();
    return before;
}

void board_unlock(uint8_t before)
{
    SREG = before;
}

ISR(USART_RX_vect)
{
    uint8_t byte = UDR0, next = (received_in + 1) % RECEIVED;
    if (next == received_out)
        return; /* the frame will fail its check, and come again */
    received[received_in] = byte;
    received_in = next;
}

ISR(USART_UDRE_vect)
{
    if (queued_in == queued_out) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
        return;
    }
    UDR0 = queued[queued_out];
    queued_out = (queued_out + 1) % QUEUED;
}

ISR(TIMER0_COMPA_vect)
{
    ms++;
}

ISR(TIMER1_COMPA_vect)
{
    run_tick();
}

ISR(ADC_vect)
{
    converting = false;
    int16_t code = (int16_t)ADC - ADC_MIDDLE;
    run_converted(code < -INPUT_TOP ? -INPUT_TOP : code);
}
