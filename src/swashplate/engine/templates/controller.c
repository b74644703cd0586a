/* One step of a swashplate controller, to be called at @RATE@ Hz.
 *
 *   void swash_step(@REAL@ memory[@MEMORY@], const @REAL@ measured[@MEASURED@],
 *                   const @REAL@ reference[8], @REAL@ command[@COMMANDS@]);
 *
 * made       @MADE@
 * vehicle    @VEHICLE@
 * late       @LATE@
 * measured   @MEASURED_NAMES@
 *            [SI, radians, forward-right-down and north-east-down]
 * reference  @REFERENCE_NAMES@
 * command    @COMMAND_NAMES@
 * memory     @MEMORY_NAMES@; starts as swash_memory says
 *
 * swash_step keeps its temporaries in a static array: one caller at a time. swash_step_in takes them from its
 * caller, @REAL@ work[SWASH_WORK], which need not survive between steps; with a memory and a work of its own
 * each caller may interrupt every other.
 */
#define SWASH_WORK @WORK@
@TRACED@
@START@
void swash_step_in(@REAL@ memory[@MEMORY@], const @REAL@ measured[@MEASURED@],
                   const @REAL@ reference[8], @REAL@ command[@COMMANDS@], @REAL@ work[SWASH_WORK]) {
  int iw[@WHOLES@];
  const @REAL@ *arg[@ARGUMENTS@];
  @REAL@ *res[@RESULTS@];
  int i;
  arg[0] = memory;
  arg[1] = measured;
  arg[2] = reference;
  res[0] = work;
  swash_traced(arg, res, iw, work + @AFTER@, 0);
  for (i = 0; i < @MEMORY@; ++i) memory[i] = work[i];
  for (i = 0; i < @COMMANDS@; ++i) command[i] = work[@MEMORY@ + i];
}

void swash_step(@REAL@ memory[@MEMORY@], const @REAL@ measured[@MEASURED@],
                const @REAL@ reference[8], @REAL@ command[@COMMANDS@]) {
  static @REAL@ work[SWASH_WORK];
  swash_step_in(memory, measured, reference, command, work);
}
