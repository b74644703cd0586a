#define MODEL_LATE @LONGEST@
#define N_PAST @PAST@
static const double model_delays[] = {@DELAYS@};
