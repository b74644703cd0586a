/* What fmu2.c needs to know of the model. */
@NAMES@#define MODEL_STEP @STEP@
#define MODEL_GUID "@GUID@"
@DELAYS@#ifdef FMI2_STATIC_LINKING
#define FMI2_FUNCTION_PREFIX @NAME@_
#endif
