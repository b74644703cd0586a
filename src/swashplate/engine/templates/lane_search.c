  {
    whole settled[LANES] = {0}, left;
    for (int step = known ? -@MOST@ : 0; step < @MOST@; ++step) {
      left = 0;
      if (step == 0) {
@BEGIN@      }
@MOVE@      if (!left) break;
    }
  }
