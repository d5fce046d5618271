; 2:1: a full circle cannot be given by its radius | give its centre with I and J
G2 R5 F600
