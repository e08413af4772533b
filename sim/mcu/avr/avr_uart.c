/* USART 0 and 1 at their true baud: transmit with one byte of buffer, receive with three, overrun and framing errors.
 */
#include <stddef.h>

#include "avr_mcu.h"

static const double CYCLE_NS = 1e9 / SHOAL_CPU_HZ;

static uint8_t *registers(const mcu *m, const mcu_uart *u) { return m->avr->data + u->base; }

/* A bit of the rate that the firmware programmed: 115200 with U2X at 16 MHz is really 117647. */
static double firmware_bit_ns(const mcu *m, const mcu_uart *u) {
  const uint8_t *r = registers(m, u);
  unsigned divider = ((r[AVR_UBRRH] & 0x0Fu) << 8 | r[AVR_UBRRL]) + 1;
  return divider * (r[0] & UCSRA_U2X ? 8 : 16) * CYCLE_NS;
}

static mcu_uart *uart_at(mcu *m, avr_io_addr_t address) { return &m->uart[address >= AVR_UCSR1A]; }
static bool is_companion(const mcu *m, const mcu_uart *u) { return u == &m->uart[MCU_PORT_COMPANION]; }

/* What the far end makes of a byte: noise, and garbage when format or baud differ. */
static uint8_t over_the_wire(mcu *m, mcu_uart *u, line *l, uint8_t value, bool to_host, bool *bad_frame) {
  bool companion = is_companion(m, u);
  uint64_t *flipped = to_host ? &m->counters.tx_corrupted : &m->counters.rx_corrupted, console = 0;
  double own_ns = firmware_bit_ns(m, u);
  value = line_noise(l, value, companion ? m->faults.companion_bit_noise : 0, companion ? flipped : &console);
  value = line_sample(value, to_host ? own_ns : u->host_bit_ns, to_host ? u->host_bit_ns : own_ns, bad_frame);
  if ((registers(m, u)[AVR_UCSRC]) != UCSRC_8N1) *bad_frame = true;
  return value;
}

static void show_fifo(mcu *m, mcu_uart *u) {
  uint8_t *r = registers(m, u);
  r[0] = (uint8_t)((r[0] & ~(UCSRA_FE | UCSRA_DOR)) | (u->fifo_count ? u->fifo_error[0] : 0) |
                   (u->overrun ? UCSRA_DOR : 0));
  avr_set_flag(m, u->receive, u->fifo_count > 0);
}

static avr_cycle_count_t byte_arrived(avr_t *avr, avr_cycle_count_t when, void *param);

static void await_byte(mcu *m, mcu_uart *u) {
  const line_byte *next = line_front(&u->to_mcu);
  if (next) avr_call_at(m, avr_cycle_at(next->end_ns), byte_arrived, u);
}

static avr_cycle_count_t byte_arrived(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)when;
  mcu *m = avr->custom.data;
  mcu_uart *u = param;
  const line_byte *front = line_front(&u->to_mcu);
  bool bad_frame, cut = is_companion(m, u) && m->faults.companion_cut;
  uint8_t value = over_the_wire(m, u, &u->to_mcu, front->value, false, &bad_frame);
  line_pop(&u->to_mcu);
  await_byte(m, u);
  if (cut || !(registers(m, u)[AVR_UCSRB] & UCSRB_RXEN)) return 0;
  if (u->fifo_count == 3) {
    u->overrun = true;
    m->counters.rx_overruns++;
  } else {
    u->fifo[u->fifo_count] = value;
    u->fifo_error[u->fifo_count++] = bad_frame ? UCSRA_FE : 0;
  }
  show_fifo(m, u);
  return 0;
}

static uint8_t read_data(avr_t *avr, avr_io_addr_t address, void *param) {
  (void)avr;
  mcu *m = param;
  mcu_uart *u = uart_at(m, address);
  if (!u->fifo_count) return 0;
  uint8_t value = u->fifo[0];
  u->fifo_count--;
  for (int i = 0; i < u->fifo_count; ++i) {
    u->fifo[i] = u->fifo[i + 1];
    u->fifo_error[i] = u->fifo_error[i + 1];
  }
  u->overrun = false;
  avr_set_flag(m, u->receive, false);
  show_fifo(m, u);
  return value;
}

static avr_cycle_count_t byte_sent(avr_t *avr, avr_cycle_count_t when, void *param);

/* The byte enters the line now and is queued with the end of its stop bit, when the host may read it. */
static void shift_out(mcu *m, mcu_uart *u, uint8_t value, avr_cycle_count_t start) {
  u->shifting = true;
  double bit_ns = firmware_bit_ns(m, u);
  bool bad_frame, cut = is_companion(m, u) && m->faults.companion_cut;
  value = over_the_wire(m, u, &u->to_host, value, true, &bad_frame);
  if (!cut) line_send(&u->to_host, value, avr_ns(start), bit_ns);
  avr_call_at(m, start + (avr_cycle_count_t)(LINE_BITS * bit_ns / CYCLE_NS + 0.5), byte_sent, u);
}

static avr_cycle_count_t byte_sent(avr_t *avr, avr_cycle_count_t when, void *param) {
  mcu *m = avr->custom.data;
  mcu_uart *u = param;
  u->shifting = false;
  if (u->holding) {
    u->holding = false;
    shift_out(m, u, u->held, when);
    avr_set_flag(m, u->empty, true);
  } else {
    avr_set_flag(m, u->transmitted, true);
  }
  return 0;
}

static void write_data(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  mcu_uart *u = uart_at(m, address);
  if (!(registers(m, u)[AVR_UCSRB] & UCSRB_TXEN) || u->holding) return;
  avr_set_flag(m, u->empty, false);
  if (u->shifting) {
    u->held = value;
    u->holding = true;
  } else {
    shift_out(m, u, value, avr->cycle);
    avr_set_flag(m, u->empty, true);
  }
}

static void write_status(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  mcu_uart *u = uart_at(m, address);
  avr->data[address] = (uint8_t)((avr->data[address] & ~(UCSRA_U2X | 1)) | (value & (UCSRA_U2X | 1)));
  if (value & UCSRA_TXC) avr_set_flag(m, u->transmitted, false);
}

/* An interrupt that is enabled while its flag stands is taken at once. */
static void write_control(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  mcu *m = param;
  mcu_uart *u = uart_at(m, address);
  uint8_t *r = registers(m, u), risen = value & (uint8_t)~avr->data[address];
  avr->data[address] = value;
  if (!(value & UCSRB_RXEN)) {
    u->fifo_count = 0;
    u->overrun = false;
    show_fifo(m, u);
  }
  if ((risen & UCSRB_RXCIE) && (r[0] & UCSRA_RXC)) avr_set_flag(m, u->receive, true);
  if ((risen & UCSRB_UDRIE) && (r[0] & UCSRA_UDRE)) avr_set_flag(m, u->empty, true);
  if ((risen & UCSRB_TXCIE) && (r[0] & UCSRA_TXC)) avr_set_flag(m, u->transmitted, true);
}

static void attach(mcu *m, int number, uint32_t baud) {
  mcu_uart *u = &m->uart[number];
  avr_uart_t *stock = avr_module(m->avr, "uart", offsetof(avr_uart_t, name), (char)('0' + number), true);
  stock->flags = 0;
  u->receive = &stock->rxc;
  u->empty = &stock->udrc;
  u->transmitted = &stock->txc;
  u->base = number ? AVR_UCSR1A : AVR_UCSR0A;
  u->host_bit_ns = 1e9 / baud;
  avr_on_write(m, u->base, write_status);
  avr_on_read(m, u->base, NULL);
  avr_on_write(m, u->base + AVR_UCSRB, write_control);
  avr_on_write(m, u->base + AVR_UBRRL, NULL);
  avr_on_write(m, u->base + AVR_UDR, write_data);
  avr_on_read(m, u->base + AVR_UDR, read_data);
}

void avr_uart_attach(mcu *m, const mcu_config *config) {
  attach(m, MCU_PORT_CONSOLE, SHOAL_CONSOLE_BAUD);
  attach(m, MCU_PORT_COMPANION, config->baud ? config->baud : SHOAL_COMPANION_BAUD);
  for (int i = 0; i < AVR_UARTS; ++i) {
    line_init(&m->uart[i].to_mcu, config->seed, 2 * (uint64_t)i + 1);
    line_init(&m->uart[i].to_host, config->seed, 2 * (uint64_t)i + 2);
  }
}

void avr_uart_restart(mcu *m) {
  for (int i = 0; i < AVR_UARTS; ++i) {
    mcu_uart *u = &m->uart[i];
    u->fifo_count = 0;
    u->overrun = u->shifting = u->holding = false;
    line_cut_short(&u->to_host, avr_now_ns(m));
    uint8_t *r = registers(m, u);
    r[0] = UCSRA_UDRE;
    r[AVR_UCSRB] = 0;
    r[AVR_UCSRC] = UCSRC_8N1;
    await_byte(m, u);
  }
}

size_t mcu_uart_write(mcu *m, int port, const uint8_t *bytes, size_t count, uint64_t not_before_us) {
  mcu_uart *u = &m->uart[port];
  uint64_t now = avr_ns(m->target), start = not_before_us * 1000, taken = 0;
  bool waiting = line_front(&u->to_mcu) != NULL;
  while (taken < count && line_send(&u->to_mcu, bytes[taken], start > now ? start : now, u->host_bit_ns)) taken++;
  if (!waiting) await_byte(m, u);
  return taken;
}

size_t mcu_uart_read(mcu *m, int port, uint8_t *bytes, size_t capacity) {
  line *l = &m->uart[port].to_host;
  size_t count = 0;
  for (const line_byte *b; count < capacity && (b = line_front(l)) && b->end_ns <= avr_ns(m->target); line_pop(l))
    bytes[count++] = b->value;
  return count;
}
