/* Loads an ELF image into program memory and EEPROM, and names its addresses. */
#include <errno.h>
#include <fcntl.h>
#include <gelf.h>
#include <libelf.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "avr_mcu.h"

/* Where the GNU linker puts the address spaces of an AVR. */
enum { DATA_SPACE = 0x800000, EEPROM_SPACE = 0x810000, MACHINE_AVR = 83 };

static bool load_segments(mcu *m, Elf *elf, const char *path, char *error, size_t error_size) {
  size_t count, size, loaded = 0;
  const char *file = elf_rawfile(elf, &size);
  if (!file || elf_getphdrnum(elf, &count) != 0) return false;
  for (size_t i = 0; i < count; ++i) {
    GElf_Phdr segment;
    if (!gelf_getphdr(elf, (int)i, &segment) || segment.p_type != PT_LOAD || !segment.p_filesz) continue;
    if (segment.p_offset > size || segment.p_filesz > size - segment.p_offset) {
      snprintf(error, error_size, "%s: truncated at %zu bytes; build it again", path, size);
      return false;
    }
    uint64_t end = segment.p_paddr + segment.p_filesz;
    if (end <= AVR_FLASH_BYTES) {
      memcpy(m->avr->flash + segment.p_paddr, file + segment.p_offset, segment.p_filesz);
      loaded += segment.p_filesz;
    } else if (segment.p_paddr >= EEPROM_SPACE && end <= EEPROM_SPACE + MCU_EEPROM_BYTES) {
      memcpy(m->eeprom.store->eeprom + (segment.p_paddr - EEPROM_SPACE), file + segment.p_offset, segment.p_filesz);
    } else if (segment.p_paddr < DATA_SPACE) {
      snprintf(error, error_size, "%s: program reaches 0x%llx, beyond the %d bytes of the ATmega2560", path,
               (unsigned long long)end, AVR_FLASH_BYTES);
      return false;
    }
  }
  if (!loaded) snprintf(error, error_size, "%s: holds no program", path);
  return loaded != 0;
}

static int by_address(const void *a, const void *b) {
  uint32_t x = ((const avr_image_symbol *)a)->address, y = ((const avr_image_symbol *)b)->address;
  return (x > y) - (x < y);
}

static void load_symbols(mcu *m, Elf *elf) {
  for (Elf_Scn *section = elf_nextscn(elf, NULL); section; section = elf_nextscn(elf, section)) {
    GElf_Shdr header;
    if (!gelf_getshdr(section, &header) || header.sh_type != SHT_SYMTAB || !header.sh_entsize) continue;
    Elf_Data *data = elf_getdata(section, NULL);
    size_t count = header.sh_size / header.sh_entsize;
    m->symbols = calloc(count, sizeof *m->symbols);
    for (size_t i = 0; data && m->symbols && i < count; ++i) {
      GElf_Sym symbol;
      if (!gelf_getsym(data, (int)i, &symbol) || symbol.st_value >= AVR_FLASH_BYTES) continue;
      bool named = GELF_ST_TYPE(symbol.st_info) == STT_FUNC || GELF_ST_BIND(symbol.st_info) == STB_GLOBAL;
      if (!named || symbol.st_shndx == SHN_ABS || symbol.st_shndx == SHN_UNDEF) continue;
      const char *name = elf_strptr(elf, header.sh_link, symbol.st_name);
      char *copy = name ? strdup(name) : NULL;
      if (copy) m->symbols[m->symbol_count++] = (avr_image_symbol){.address = (uint32_t)symbol.st_value, .name = copy};
    }
    qsort(m->symbols, m->symbol_count, sizeof *m->symbols, by_address);
    return;
  }
}

bool avr_load_image(mcu *m, const char *path, char *error, size_t error_size) {
  if (!path || !*path) {
    snprintf(error, error_size, "no firmware image given; build one with `make firmware`");
    return false;
  }
  int file = open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    snprintf(error, error_size, "%s: %s; build the image with `make firmware`", path, strerror(errno));
    return false;
  }
  elf_version(EV_CURRENT);
  Elf *elf = elf_begin(file, ELF_C_READ, NULL);
  GElf_Ehdr header;
  bool loaded = false;
  if (!elf || elf_kind(elf) != ELF_K_ELF || !gelf_getehdr(elf, &header) || header.e_machine != MACHINE_AVR) {
    snprintf(error, error_size, "%s: not an ELF image for AVR", path);
  } else {
    snprintf(error, error_size, "%s: damaged ELF image", path);
    loaded = load_segments(m, elf, path, error, error_size);
    if (loaded) load_symbols(m, elf);
  }
  if (elf) elf_end(elf);
  close(file);
  if (loaded && error_size) error[0] = 0;
  return loaded;
}

void avr_describe(const mcu *m, uint32_t address, char *text, size_t size) {
  const avr_image_symbol *nearest = NULL;
  for (size_t i = 0; i < m->symbol_count && m->symbols[i].address <= address; ++i) nearest = &m->symbols[i];
  if (nearest)
    snprintf(text, size, "%s+0x%x (0x%05x)", nearest->name, address - nearest->address, address);
  else
    snprintf(text, size, "0x%05x", address);
}

void avr_free_symbols(mcu *m) {
  for (size_t i = 0; i < m->symbol_count; ++i) free(m->symbols[i].name);
  free(m->symbols);
}
