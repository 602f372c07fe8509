"""What pictures of a moving mesh are made from: the teeth in section, their motion, the colours of the flanks."""
