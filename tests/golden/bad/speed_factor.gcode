; 2:6: M220 S0 is outside 1 to 300 % | the factor is in percent: 100 is as sliced
M220 S0
