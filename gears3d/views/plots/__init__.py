"""What every picture is made from: colours, numbers with units, teeth in section, their motion, drawings of a pair."""
