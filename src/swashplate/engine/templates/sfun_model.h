/* In MATLAB: mex @NAME@_sfun.c @NAME@.c
 * then an S-Function block with the name @NAME@_sfun and no parameters. */
#define S_FUNCTION_NAME @NAME@_sfun
@NAMES@