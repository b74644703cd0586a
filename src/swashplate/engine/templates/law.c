@TRACED@

/* One step of the law in lane l. */
static void law(double *memory, const double *measured, const double *asked, lanes *command, int l) {
  double work[@LONGEST@], after[MEMORY + @INPUTS@]; /* on the stack: several threads may fly */
  int whole[@WHOLES@];
  const double *arguments[@ARGUMENTS@] = {memory, measured, asked};
  double *results[@RESULTS@] = {after};
  @NAME@(arguments, results, whole, work, 0);
  for (int i = 0; i < MEMORY; ++i) memory[i] = after[i];
  for (int j = 0; j < @INPUTS@; ++j) command[j][l] = after[MEMORY + j];
}
