/* What a Cortex-M does before the C library's start: its table of vectors, and the floating-point unit switched on. */
extern char stack_top[]; /* memory.ld */
void _start(void);       /* of newlib */

static void reset(void)
{
  *(volatile unsigned *)0xE000ED88 |= 0xFu << 20; /* CPACR: coprocessors 10 and 11 */
  _start();
}

/* Whatever goes wrong ends here, until the caller's time is over. */
static void fault(void)
{
  for (;;) {
  }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault};
