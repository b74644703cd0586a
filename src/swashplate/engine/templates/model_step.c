void @NAME@_step(@REAL@ *x, const @REAL@ *u, const @REAL@ *s, const @REAL@ *p, @REAL@ dt) {
  @REAL@ k[@NAME@_n_states], sum[@NAME@_n_states], at[@NAME@_n_states], c[@N_CONSTANTS@], root[@N_ROOTS@] = {0};
  const @REAL@ half = dt / 2, sixth = dt / 6;
  int i;
  fixed(u, s, p, c);
  moving(x, u, s, p, c, root, 0, k);
  for (i = 0; i < @NAME@_n_states; ++i) {
    sum[i] = k[i];
    at[i] = x[i] + half * k[i];
  }
  moving(at, u, s, p, c, root, 1, k);
  for (i = 0; i < @NAME@_n_states; ++i) {
    sum[i] += 2 * k[i];
    at[i] = x[i] + half * k[i];
  }
  moving(at, u, s, p, c, root, 1, k);
  for (i = 0; i < @NAME@_n_states; ++i) {
    sum[i] += 2 * k[i];
    at[i] = x[i] + dt * k[i];
  }
  moving(at, u, s, p, c, root, 1, k);
  for (i = 0; i < @NAME@_n_states; ++i) x[i] += sixth * (sum[i] + k[i]);
}
