; 2:5: G64 P0 is outside 0.01 to 50 mm | P is how far the nozzle may leave the drawn path; G61 stops at the end of every move
G64 P0
