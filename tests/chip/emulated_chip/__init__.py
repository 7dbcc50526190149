"""An STM32H743, or one of its family, for the image that is flashed: the processor of Unicorn, the chip around it from the reference manual.

Sections are those of RM0433, "STM32H742, STM32H743/753 and STM32H750 Value line", where nothing else is named. Registers,
fields, interrupt numbers and clock bits are read from the description that `stm32-metapac` has of the chip.
"""
