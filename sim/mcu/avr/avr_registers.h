/* Data addresses and bits of the ATmega2560 that the models replace (datasheet 2549, register summary). */
#pragma once

enum {
  AVR_PINA = 0x20,
  AVR_DDRA,
  AVR_PORTA,
  AVR_PINB,
  AVR_DDRB,
  AVR_PORTB,
  AVR_PIND = 0x29,
  AVR_DDRD,
  AVR_PORTD,
  AVR_DDRE = 0x2D,
  AVR_EECR = 0x3F,
  AVR_EEDR,
  AVR_EEARL,
  AVR_EEARH,
  AVR_SPCR = 0x4C,
  AVR_SPSR,
  AVR_SPDR,
  AVR_SMCR = 0x53,
  AVR_MCUSR,
  AVR_TCCR3A = 0x90,
  AVR_TCCR4A = 0xA0,
  AVR_TWBR = 0xB8,
  AVR_TWSR,
  AVR_TWAR,
  AVR_TWDR,
  AVR_TWCR,
  AVR_UCSR0A = 0xC0,
  AVR_UCSR1A = 0xC8,
  AVR_DDRH = 0x101
};

/* Offsets from UCSRnA. */
enum { AVR_UCSRB = 1, AVR_UCSRC = 2, AVR_UBRRL = 4, AVR_UBRRH = 5, AVR_UDR = 6 };

enum { UCSRA_U2X = 0x02, UCSRA_DOR = 0x08, UCSRA_FE = 0x10, UCSRA_UDRE = 0x20, UCSRA_TXC = 0x40, UCSRA_RXC = 0x80 };
enum { UCSRB_TXEN = 0x08, UCSRB_RXEN = 0x10, UCSRB_UDRIE = 0x20, UCSRB_TXCIE = 0x40, UCSRB_RXCIE = 0x80 };
enum { UCSRC_8N1 = 0x06 };
enum { SPCR_SPR = 0x03, SPCR_MODE = 0x0C, SPCR_MSTR = 0x10, SPCR_DORD = 0x20, SPCR_SPE = 0x40, SPCR_SPIE = 0x80 };
enum { SPSR_SPI2X = 0x01, SPSR_WCOL = 0x40, SPSR_SPIF = 0x80 };
enum {
  TWCR_TWIE = 0x01,
  TWCR_TWEN = 0x04,
  TWCR_TWWC = 0x08,
  TWCR_TWSTO = 0x10,
  TWCR_TWSTA = 0x20,
  TWCR_TWEA = 0x40,
  TWCR_TWINT = 0x80
};
enum { SMCR_SE = 0x01, SMCR_SM = 0x0E };
enum {
  EECR_EERE = 0x01,
  EECR_EEPE = 0x02,
  EECR_EEMPE = 0x04,
  EECR_EERIE = 0x08,
  EECR_EEPM0 = 0x10,
  EECR_EEPM1 = 0x20,
  EECR_EEPM = 0x30
};
